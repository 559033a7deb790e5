#include <algorithm>
#include <array>
#include <charconv>
#include <optional>

#include "base/error.h"
#include "synth/basket.h"
#include "synth/church.h"
#include "synth/dog.h"
#include "synth/gallery.h"
#include "synth/scanner.h"
#include "synth/statuette.h"

namespace scanview {

namespace {

/// A model of any number of polygons: NAME or NAME:POLYGONS.
struct SizedModel {
  std::string name;
  std::size_t polygons;  ///< unless told
  TriangleMesh (*make)(std::size_t polygons);
};

std::array<SizedModel, 2> const kSized = {{{"gallery", 100'000, make_gallery}, {"church", 200'000, make_church}}};

std::optional<SizedModel> sized_model(std::string const& name) {
  for (SizedModel const& each : kSized)
    if (name == each.name || name.starts_with(each.name + ":")) return each;
  return std::nullopt;
}

std::size_t polygons_wanted(SizedModel const& model, std::string const& name) {
  if (name == model.name) return model.polygons;
  std::size_t polygons = 0;
  char const *const first = name.data() + model.name.size() + 1, *const last = name.data() + name.size();
  auto const parsed = std::from_chars(first, last, polygons);
  if (parsed.ec != std::errc() || parsed.ptr != last)
    throw Error(ErrorCode::usage, {}, "built-in model \"" + name + "\": expected " + model.name + ":POLYGONS");
  return polygons;
}

}  // namespace

TriangleMesh builtin_model(std::string const& name) {
  Context context;
  if (name == "dog") return make_dog(0.4f, context);
  if (name == "basket") return make_basket(0.56f, context);
  if (name == "statuette") return make_statuette(0.36f, context);
  if (auto const sized = sized_model(name)) return sized->make(polygons_wanted(*sized, name));
  std::string known;
  for (auto const& each : builtin_model_names()) known += (known.empty() ? "" : ", ") + each;
  throw Error(ErrorCode::usage, {}, "unknown built-in model \"" + name + "\" (there is: " + known + ")");
}

std::vector<std::string> builtin_model_names() {
  std::vector<std::string> names = {"dog", "basket", "statuette"};
  for (SizedModel const& each : kSized) names.push_back(each.name);
  return names;
}

bool is_builtin_model(std::string const& name) {
  auto const names = builtin_model_names();
  return sized_model(name).has_value() || std::find(names.begin(), names.end(), name) != names.end();
}

}  // namespace scanview

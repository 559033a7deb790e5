#include <algorithm>
#include <charconv>

#include "base/error.h"
#include "synth/basket.h"
#include "synth/dog.h"
#include "synth/gallery.h"
#include "synth/scanner.h"
#include "synth/statuette.h"

namespace scanview {

namespace {

std::string const kGallery = "gallery";
constexpr std::size_t kGalleryPolygons = 100'000;

/// Of "gallery" or "gallery:N".
std::size_t gallery_polygons(std::string const& name) {
  if (name == kGallery) return kGalleryPolygons;
  std::size_t polygons = 0;
  char const *const first = name.data() + kGallery.size() + 1, *const last = name.data() + name.size();
  auto const parsed = std::from_chars(first, last, polygons);
  if (parsed.ec != std::errc() || parsed.ptr != last)
    throw Error(ErrorCode::usage, {}, "built-in model \"" + name + "\": expected gallery:POLYGONS");
  return polygons;
}

}  // namespace

TriangleMesh builtin_model(std::string const& name) {
  Context context;
  if (name == "dog") return make_dog(0.4f, context);
  if (name == "basket") return make_basket(0.56f, context);
  if (name == "statuette") return make_statuette(0.36f, context);
  if (is_builtin_model(name)) return make_gallery(gallery_polygons(name));
  std::string known;
  for (auto const& each : builtin_model_names()) known += (known.empty() ? "" : ", ") + each;
  throw Error(ErrorCode::usage, {}, "unknown built-in model \"" + name + "\" (there is: " + known + ")");
}

std::vector<std::string> builtin_model_names() { return {"dog", "basket", "statuette", "gallery"}; }

bool is_builtin_model(std::string const& name) {
  auto const names = builtin_model_names();
  return name.starts_with(kGallery + ":") || std::find(names.begin(), names.end(), name) != names.end();
}

}  // namespace scanview

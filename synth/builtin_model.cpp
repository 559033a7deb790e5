#include "base/error.h"
#include "synth/basket.h"
#include "synth/dog.h"
#include "synth/scanner.h"
#include "synth/statuette.h"

namespace scanview {

TriangleMesh builtin_model(std::string const& name) {
  Context context;
  if (name == "dog") return make_dog(0.4f, context);
  if (name == "basket") return make_basket(0.56f, context);
  if (name == "statuette") return make_statuette(0.36f, context);
  std::string known;
  for (auto const& each : builtin_model_names()) known += (known.empty() ? "" : ", ") + each;
  throw Error(ErrorCode::usage, {}, "unknown built-in model \"" + name + "\" (there is: " + known + ")");
}

std::vector<std::string> builtin_model_names() { return {"dog", "basket", "statuette"}; }

}  // namespace scanview

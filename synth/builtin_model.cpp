#include "base/error.h"
#include "synth/scanner.h"
#include "synth/statuette.h"

namespace scanview {

TriangleMesh builtin_model(std::string const& name) {
  Context context;
  if (name == "statuette") return make_statuette(0.36f, context);
  std::string known;
  for (auto const& each : builtin_model_names()) known += (known.empty() ? "" : ", ") + each;
  throw Error(ErrorCode::usage, {}, "unknown built-in model \"" + name + "\" (there is: " + known + ")");
}

std::vector<std::string> builtin_model_names() { return {"statuette"}; }

}  // namespace scanview

#pragma once
#include <string>
#include <vector>

#include "cli/stages.h"

namespace CLI {
class App;
}

namespace scanview {

/// The options of `acquire` that `run` takes too; depth range and background have their own in `run`.
struct AcquireFlags {
  std::filesystem::path manifest;  ///< --capture: in place of CAPTURE/capture.json
  std::string decoder = "space-time";
  bool measure_reading = false;
  AcquireOptions options;
};
void add_acquire_flags(CLI::App& verb, AcquireFlags& flags);
/// `capture` is a folder, or its capture.json.
AcquireRequest resolve(AcquireFlags const& flags, std::filesystem::path const& capture,
                       std::vector<std::string> const& settings);

}  // namespace scanview

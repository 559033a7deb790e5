#pragma once
#include <string>
#include <vector>

#include "acquire/import.h"

namespace CLI {
class App;
}

namespace scanview {

/// The options of `import`, which `run` takes too.
struct ImportFlags {
  ImportOptions options;
  std::vector<double> box;
  std::string background = "auto";
};
void add_import_flags(CLI::App& verb, ImportFlags& flags);
ImportOptions resolve(ImportFlags const& flags);

}  // namespace scanview

#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "cli/stages.h"

namespace CLI {
class App;
}

namespace scanview {

/// The options of `register`, which `run` takes too.
struct RegisterFlags {
  std::string init;  ///< empty: given poses where the set has them, else a turntable
  bool no_refine = false;
};
void add_register_flags(CLI::App& verb, RegisterFlags& flags);
RegisterRequest resolve(RegisterFlags const& flags, std::vector<std::string> const& settings);

/// The options of `mesh`.
struct MeshFlags {
  std::string tolerance = "auto";
  int triangles = 0;
  int levels = 1;
  std::string placement = "insertion", fit = "joint";
  std::filesystem::path marks;
};
void add_mesh_flags(CLI::App& verb, MeshFlags& flags);
MeshRequest resolve(MeshFlags const& flags, std::vector<std::string> const& settings);

}  // namespace scanview

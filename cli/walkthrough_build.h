#pragma once
#include <filesystem>
#include <string>

#include "base/context.h"
#include "base/files.h"
#include "cli/node_source.h"
#include "mesh/node_mesh.h"

namespace scanview {

struct WalkthroughBuildOptions {
  NodeMeshOptions mesh;  ///< walking_radius 0: half of the median distance between neighbouring nodes
  int levels = 2;        ///< of detail: each next one has pictures of half the size and a quarter of the triangles
};

/// Captures, simplifies and writes the nodes of a scene one after the other, so that no more than one is in memory: the
/// folder of a walkthrough, whole or not at all. Returns the figures of `--report`.
Json build_walkthrough(NodeSource& scene, std::filesystem::path const& output, WalkthroughBuildOptions const& options,
                       Context& context);

}  // namespace scanview

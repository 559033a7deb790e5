#pragma once
#include <Eigen/Geometry>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "acquire/scan_set.h"
#include "base/files.h"

namespace scanview {

/// What is known of a scene's nodes before any of them is read: FOLDER/walkthrough.json.
struct WalkthroughManifest {
  struct Node {
    std::string name;
    Eigen::Vector3d position{0, 0, 0};
    std::size_t triangles = 0;        ///< in full detail
    double parallax_px = 0;           ///< NodeMesh
    std::vector<std::string> levels;  ///< folders of write_node_mesh(), relative; the first in full detail
  };
  Unit unit = Unit::m;
  double walking_radius = 1;  ///< NodeMeshOptions
  double focal_length = 1;    ///< pixels: the median of the sides' in full detail
  Eigen::Vector3d up{0, 1, 0};
  std::vector<Node> nodes;
  std::optional<Eigen::AlignedBox3d> walk;  ///< where eyes were expected
};

/// Throws Error{bad_input} naming the key.
WalkthroughManifest read_walkthrough(std::filesystem::path const& folder);
void write_walkthrough(std::filesystem::path const& folder, WalkthroughManifest const& manifest);
/// Whether a folder is one of a walkthrough.
bool is_walkthrough(std::filesystem::path const& folder);

}  // namespace scanview

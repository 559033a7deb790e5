#pragma once
#include <Eigen/Core>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "acquire/captured_node.h"
#include "mesh/node_mesh.h"
#include "synth/node_placement.h"
#include "viewer/walkthrough/policy_figures.h"

namespace scanview {

/// How nodes are captured.
struct NodeSourceOptions {
  std::string nodes = "auto";         ///< of a model: auto, or a file with positions
  int size = 512;                     ///< pixels across a side of a node (models, panoramas)
  std::string light = "baked";        ///< of a model: baked, or painted
  std::string winding = "automatic";  ///< of a model: automatic, keep, flip
  std::optional<double> eye_height;   ///< above the floor, for auto
  std::vector<double> walk;           ///< low and high corner of where eyes are, six numbers, for auto
  double greatest_gap = 0.03;         ///< PlacementOptions
  double clearance = 0;               ///< PlacementOptions
  std::string hold_out;               ///< of a set: every:N; those views are no nodes
};

/// What nodes are captured from: a model that is ray traced, a set of RGB-D frames, panoramas with depth.
class NodeSource {
 public:
  virtual ~NodeSource() = default;
  virtual Unit unit() const = 0;
  virtual Eigen::Vector3d up() const = 0;
  virtual std::vector<Eigen::Vector3d> positions() const = 0;
  std::size_t count() const { return positions().size(); }
  virtual CapturedNode capture(std::size_t node, Context& context) = 0;
  /// What a pixel without depth means, and how much of a set's gaps is bridged.
  virtual void adjust(NodeMeshOptions& options) const = 0;
  virtual std::optional<Eigen::AlignedBox3d> walk() const { return std::nullopt; }
  /// Figures of automatic placement.
  virtual Json placement() const { return nullptr; }
  /// What frames should look like. Of a model: traced along the path. Of a set: the photographs of views that are no
  /// nodes, whatever the path.
  virtual std::vector<ReferenceFrame> references(std::vector<PathCamera> const& path, Context& context) = 0;
};

/// `scene`: a file with a model or a built-in one's name, a scan set's folder, or panoramas.json or its folder. Throws
/// Error{bad_input} where it is nothing of these. With `Places::none` nothing is placed: for references alone.
enum class Places { chosen, none };
std::unique_ptr<NodeSource> open_node_source(std::string const& scene, NodeSourceOptions const& options, Places places,
                                             Context& context);

/// N of "every:N", at least 2: each Nth view is held out; 0 where nothing is said. Throws Error{usage}.
std::size_t held_out_step(std::string const& hold_out);

/// Positions a person chose: a JSON list of [x, y, z], or {"nodes": [{"name": "...", "position": [x, y, z]}]}. Throws
/// Error{bad_input}.
std::vector<Eigen::Vector3d> read_node_positions(std::filesystem::path const& file);

}  // namespace scanview

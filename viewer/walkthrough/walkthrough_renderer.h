#pragma once
#include <cstddef>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "viewer/raster/layer_rasterizer.h"
#include "viewer/renderer.h"
#include "viewer/walkthrough/node_library.h"
#include "viewer/walkthrough/walkthrough_options.h"

namespace scanview {

/// A node that was drawn, and how much it counts where several show a surface.
struct UsedNode {
  std::size_t node = 0;
  double distance = 0;
  double weight = 0;                     ///< of positional blending; the merged nodes' sum to 1, a filling one has 0
  std::size_t sides = 0, triangles = 0;  ///< drawn: those whose side may show something
};

/// Draws a scene from its nodes (Darsa 1998), with the CPU rasteriser: the nodes nearest to the eye are warped by
/// drawing their triangles and merged by the compositor (SoftZ) as the policy says; what none of them shows is looked
/// for in further nodes, in the gaps alone, and at last in the nodes' panes.
class WalkthroughRenderer final : public Renderer {
 public:
  /// threads: at most so many; 0: all processors. Throws Error{usage}, and Error{bad_input} for a library without
  /// nodes.
  WalkthroughRenderer(std::shared_ptr<NodeLibrary> library, WalkthroughOptions const& options, int threads = 0);

  /// `scene_from_camera` takes the place of object_from_camera.
  Frame render(Camera const& camera, Eigen::Isometry3d const& scene_from_camera) override;

  void set_options(WalkthroughOptions const& options);
  WalkthroughOptions const& options() const { return options_; }
  /// Nodes that are not used (held out), by index.
  void exclude(std::vector<std::size_t> nodes);
  /// An impatient renderer (a window that must answer) leaves out nodes that are still being read; a patient one waits.
  enum class Patience { waits, answers };
  void set_patience(Patience patience) { patience_ = patience; }
  /// Whether nodes were left out of the last frame because they are still being read.
  bool complete() const { return complete_; }

  /// Of the last frame, nearest first.
  std::vector<UsedNode> const& used() const { return used_; }
  /// Pixels of the last frame that no node showed (those that were interpolated then included).
  std::size_t uncovered() const { return uncovered_; }
  /// Milliseconds of the last frame's stages, by name.
  std::map<std::string, double> const& stages() const { return stages_; }
  NodeLibrary& library() const { return *library_; }

 private:
  struct Drawn {
    std::shared_ptr<RasterNode const> node;
    std::size_t index;
    double weight;
  };
  std::vector<UsedNode> nodes_by_distance(Eigen::Vector3d const& eye) const;
  std::shared_ptr<RasterNode const> get(UsedNode const& used);
  void draw(std::vector<Drawn> const& nodes, Camera const& camera, Eigen::Isometry3d const& scene_from_camera,
            cv::Mat4b color, cv::Mat1f depth);
  bool fill(Drawn const& node, UsedNode& used, Camera const& camera, Eigen::Isometry3d const& scene_from_camera,
            Frame& frame, RasterNode::What what);
  void fill_gaps(Drawn const& node, Camera const& camera, Eigen::Isometry3d const& scene_from_camera, cv::Mat4b color,
                 cv::Mat1f depth, RasterNode::What what);

  std::shared_ptr<NodeLibrary> library_;
  WalkthroughOptions options_;
  LayerRasterizer rasterizer_;
  std::vector<char> excluded_;
  Patience patience_ = Patience::waits;
  bool complete_ = true;
  std::vector<UsedNode> used_;
  std::size_t uncovered_ = 0;
  std::map<std::string, double> stages_;
  Frame last_;
};

}  // namespace scanview

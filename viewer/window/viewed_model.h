#pragma once
#include <Eigen/Geometry>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "mesh/polygon_model.h"
#include "viewer/raster/triangle_bins.h"
#include "viewer/visibility/feature_lines.h"
#include "viewer/visibility/triangle_planes.h"
#include "viewer/visibility/visibility_selector.h"
#include "viewer/window/measuring.h"

namespace scanview {

/// What a person can toggle about how a model is drawn.
struct ModelLook {
  bool visibility = true;  ///< only what the field says can be seen from the choosing eye; without a field, everything
  bool facing = true;      ///< also leaves out triangles that turn to it the side nobody sees
  bool culled = false;     ///< shows faintly what is left out
  bool lines = false;      ///< silhouettes, rims and creases in black on white paper instead of surfaces
  bool operator==(ModelLook const&) const = default;
};

/// What was drawn last.
struct ModelFigures {
  std::size_t triangles = 0;       ///< drawn, without those shown faintly
  std::size_t ranges = 0;          ///< of the index buffer
  std::size_t patches = 0;         ///< seen ones
  double select_microseconds = 0;  ///< to choose; 0 where nothing was to be chosen
  bool is_whole = true;            ///< everything: visibility is off, or the eye nearer than its samples
  std::size_t lines = 0;           ///< before the hidden ones are left out
};

/// A polygon model that is being looked at, with what is known about its visibility. Drawn by the processor, each
/// triangle in one tone: light falls from the eye's upper left, and backs are reddish.
class ViewedModel {
 public:
  /// Throws Error{bad_input} for a model without extent. threads: at most so many; 0: all processors.
  ViewedModel(PolygonModel model, std::optional<VisibilityField> field, int threads);
  ViewedModel(ViewedModel const&) = delete;
  ViewedModel& operator=(ViewedModel const&) = delete;

  /// Of the ball around the model that distances are measured from: the field's, where there is one.
  Eigen::Vector3d const& center() const { return center_; }
  double radius() const { return radius_; }
  std::size_t polygons() const { return polygons_; }
  std::size_t triangles() const { return drawn_.triangles.size(); }
  VisibilityField const* field() const { return field_ ? &*field_ : nullptr; }

  /// What the choosing eye (in the model's coordinates) sees, from a camera of the picture's size, and keeps it.
  ShownFrame const& render(Camera const& camera, Eigen::Isometry3d const& object_from_camera, ModelLook const& look,
                           Eigen::Vector3d const& choosing_eye);
  ShownFrame const& shown() const { return shown_; }
  ModelFigures const& figures() const { return figures_; }

 private:
  /// Triangles that are drawn in one go, and the picture of their numbers.
  struct Layer {
    RasterMesh mesh;
    std::vector<float> keys;
    std::vector<std::uint32_t> ids;
  };
  std::span<IndexRange const> choose(ModelLook const& look, Eigen::Vector3d const& eye);
  void collect(std::span<IndexRange const> ranges, bool all);
  void draw(Layer& layer);
  void find_depths();
  void shade(ModelLook const& look);
  Eigen::Vector3f color(std::uint32_t triangle, EyePoint const& eye, Eigen::Vector3f const& to_light) const;

  std::optional<VisibilityField> field_;
  std::size_t polygons_;
  TriangleMesh drawn_;
  std::vector<std::uint8_t> transparent_;  ///< of each drawn triangle; empty: none
  Eigen::AlignedBox3d bounds_;
  Eigen::Vector3d center_;
  double radius_ = 0;
  std::optional<TrianglePlanes> planes_;
  std::vector<Eigen::Vector3f> albedo_;  ///< R G B, linear; of each triangle, or one of all
  int threads_;
  std::optional<VisibilitySelector> facing_, all_sides_;  ///< made when they are first asked for
  std::optional<FeatureLines> features_;

  std::vector<IndexRange> ranges_;       ///< chosen last
  std::vector<std::uint8_t> is_chosen_;  ///< a triangle
  bool collected_ = false, collected_all_ = false;
  Layer opaque_, clear_;
  ShownFrame shown_;
  ModelFigures figures_;
};

}  // namespace scanview

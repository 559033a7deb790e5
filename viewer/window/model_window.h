#pragma once
#include <Eigen/Core>
#include <filesystem>
#include <optional>

#include "base/context.h"
#include "viewer/visibility/visibility_field.h"
#include "viewer/window/window_options.h"

namespace scanview {

/// The model's axis that is up in the window.
enum class UpAxis { x, y, z, minus_x, minus_y, minus_z };
inline constexpr int kUpAxes = 6;
Eigen::Vector3d up_direction(UpAxis axis);

struct ModelWindowOptions : BasicWindowOptions {
  UpAxis up = UpAxis::y;
  /// Where C writes cameras, for `visibility build --cameras` (read_camera_path); those that are there already stay.
  /// Empty: scanview-path-NNN.json among the pictures.
  std::filesystem::path cameras;
};

struct ModelWindowResult {
  std::optional<FrameTimes> times;  ///< where they were asked for
  double culling_rate = 0;          ///< over those frames and the few before: mean share of triangles not drawn
  double select_microseconds = 0;   ///< over the same: median time to choose what is drawn
};

/// The interactive viewer of a polygon model; returns when the person closes it. model_window_help() says the mouse and
/// the keys. With a visibility field of the model, only what it says can be seen from the eye is drawn; the eye that
/// this is chosen for can be frozen, and what was chosen for it looked at from elsewhere (Meruvia 2001, figure 1).
/// Throws Error{io} where there is no display or the OpenGL context is lost, Error{bad_input} for a model without
/// extent and a file of cameras that cannot be read.
ModelWindowResult view_model(PolygonModel model, std::optional<VisibilityField> field,
                             ModelWindowOptions const& options, Context& context);

}  // namespace scanview

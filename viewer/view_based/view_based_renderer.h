#pragma once
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "viewer/blend/soft_z.h"
#include "viewer/gl/gl_context.h"
#include "viewer/renderer.h"
#include "viewer/select/view_selection.h"
#include "viewer/view_based/view_library.h"

namespace scanview {

struct ViewBasedOptions {
  /// Soft z: samples within this depth of the nearest reliable one are averaged (units); weights ramp to zero at 1.5
  /// times it. Negative: default_threshold().
  double threshold = -1;
  /// A sample whose weight is below this share of one further away does not hide it (Pulli 1997: "a low confidence
  /// pixel in front of a high confidence one is ignored").
  double reliability_ratio = 0.05;
  /// Views beyond the three that fill what these do not see (soft_z.h); 0: the paper's three only. At most 16.
  int fill_views = 16;
  /// Views that are not used (held out).
  std::vector<std::size_t> excluded;

  /// What a sample's weight is made of (the paper's figure shows each alone); without any all samples count alike.
  bool barycentric = true, cosine = true, feather = true;
  /// soft_z; or the nearest sample alone, whatever its weight: a z-buffered collage of the views.
  enum class Visibility { soft_z, nearest } visibility = Visibility::soft_z;
  /// picture; or in false colour how much each view counts in a pixel; or which view counts most. Colours: view_hue().
  SoftZ::Show show = SoftZ::Show::picture;
  bool relight = true;  ///< where the set has a CameraLight: as if it stood with this camera as it did with the views'
  bool wireframe = false;  ///< the triangles' edges over the picture, in their views' colours
  void validate() const;
};

/// Twice what the set's error budget expects of one surface, since two views may be off to either side; where it knows
/// nothing 1 % of the set's radius. Units.
double default_threshold(ViewLibrary const& library);

/// The false colour of a view, R G B in linear light: far apart for neighbouring indices.
Eigen::Vector3f view_hue(std::size_t view);

enum class BackEnd { cpu, gl };

/// The paper's renderer: the views around the eye, blended with w = w_barycentric · w_cos · w_feather under soft
/// z-buffering. Views without triangles are left out of the view sphere.
class ViewBasedRenderer : public Renderer {
 public:
  Frame render(Camera const& camera, Eigen::Isometry3d const& object_from_camera) override;
  /// One view alone, with all the weight.
  Frame render_alone(std::size_t view, Camera const& camera, Eigen::Isometry3d const& object_from_camera);
  virtual BackEnd back_end() const = 0;

  /// Other options from now on; cheap. Throws Error{usage}, and Error{bad_input} where no view with triangles remains.
  void set_options(ViewBasedOptions const& options);
  /// As they are used: the threshold is a length.
  ViewBasedOptions const& options() const { return options_; }
  /// Other views are held out from now on; cheap. Throws Error{bad_input} where no view with triangles remains.
  void exclude(std::vector<std::size_t> const& views);
  /// An impatient renderer (a window that must answer) leaves out views whose pictures are still being read, and
  /// complete() says whether any were; a patient one waits for them.
  void set_patient(bool patient) { patient_ = patient; }
  bool complete() const { return complete_; }

  /// The views that render() would draw for this camera; ordered by view, the weights summing to 1.
  std::vector<UsedView> view_weights(Camera const& camera, Eigen::Isometry3d const& object_from_camera) const;
  /// The triangulated sphere of the views in use: triangles hold indices of views of the set.
  std::vector<Eigen::Vector3i> sphere_triangles() const;
  /// Milliseconds of the last frame's stages, by name.
  std::map<std::string, double> const& stages() const { return stages_; }
  ViewLibrary& library() const { return *library_; }

 protected:
  ViewBasedRenderer(std::shared_ptr<ViewLibrary> library, ViewBasedOptions const& options);
  /// Draws these views, whose pictures the library has (ready()).
  virtual Frame draw(std::vector<UsedView> const& views, Camera const& camera,
                     Eigen::Isometry3d const& object_from_camera) = 0;
  /// Gets what the back end needs of a view; false where it failed or, unless `wait`, is not there yet.
  virtual bool ready(std::size_t view, bool wait) = 0;

  /// How these views are mixed.
  SoftZ soft_z(std::vector<UsedView> const& views) const;
  /// Median angle between a used view and its nearest neighbour, from the centre; radians.
  double spacing() const { return spacing_; }

  std::map<std::string, double> stages_;

 private:
  std::shared_ptr<ViewLibrary> library_;
  ViewBasedOptions options_;
  std::vector<Eigen::Vector3d> directions_, used_directions_;  ///< of all views; of those that are used
  std::vector<std::size_t> used_;
  std::optional<ViewSphere> sphere_;
  double spacing_ = 1;
  mutable std::size_t last_face_ = 0;
  bool patient_ = true, complete_ = true;
};

/// With the CPU rasteriser: no OpenGL anywhere. Uses all processors, or `threads`.
std::unique_ptr<ViewBasedRenderer> make_cpu_renderer(std::shared_ptr<ViewLibrary> library,
                                                     ViewBasedOptions const& options = {}, int threads = 0);
/// With OpenGL 3.3; the context must outlive it.
std::unique_ptr<ViewBasedRenderer> make_gl_renderer(GlContext& context, std::shared_ptr<ViewLibrary> library,
                                                    ViewBasedOptions const& options = {});
/// Whether this context draws on a graphics card (llvmpipe and its like do not): where it does not, the CPU back end is
/// faster. The context must be current.
bool is_hardware(GlContext& context);

}  // namespace scanview

#pragma once
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "acquire/scan_set.h"
#include "base/context.h"
#include "mesh/view_mesh.h"

namespace scanview {

/// What renderers draw: the views of a set, their meshes, and their pictures, which are read when somebody first asks.
/// One library serves several renderers, also of several threads.
class ViewLibrary {
 public:
  /// Of a set in memory. Pictures are shared, not copied. Throws Error{bad_input} where the set has views without a
  /// pose, not one mesh a view, or no mesh with triangles at all.
  ViewLibrary(ScanSet const& set, std::vector<ViewMesh> const& meshes);
  /// Of a set's folder: the manifest and all meshes now (in parallel), pictures later. A view whose files are missing,
  /// truncated or of another size is left without triangles and named in failures(); the others work. Throws like the
  /// above, and Error{bad_input} naming the first failure where no view is left.
  static std::shared_ptr<ViewLibrary> open(std::filesystem::path const& folder, Context& context);
  ~ViewLibrary();

  /// Views, poses, gains, budget; images may be without pixels.
  ScanSet const& set() const;
  std::vector<ViewMesh> const& meshes() const;
  /// About the set's centre, holding 99 % of the surface that the views saw, weighed by w_cos; never 0.
  double radius() const;

  /// The padded picture of a view (padded_texture); read now where nobody has before. Empty where that failed: the view
  /// is then in failures() and to be left out from now on.
  cv::Mat3b picture(std::size_t view);
  /// The same without waiting: empty while it is being read in the background.
  cv::Mat3b picture_if_ready(std::size_t view);
  /// One line a view that failed, in the order of the views.
  std::vector<std::string> failures() const;
  bool failed(std::size_t view) const;

 private:
  struct State;
  explicit ViewLibrary(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace scanview

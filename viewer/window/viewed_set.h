#pragma once
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "base/context.h"
#include "viewer/gl/gl_context.h"
#include "viewer/select/camera_path.h"
#include "viewer/view_based/view_based_renderer.h"
#include "viewer/window/file_watch.h"
#include "viewer/window/look.h"
#include "viewer/window/measuring.h"
#include "viewer/window/sphere_inset.h"

namespace scanview {

/// A set that is being looked at: its library, which follows the set's files, what draws it, and the frame drawn last.
class ViewedSet {
 public:
  /// `folder` is the set's; empty for a set in memory. Without a `back_end`, OpenGL on a graphics card and otherwise
  /// the processor. `context` must be current, and outlive this; the same holds when this is destroyed.
  ViewedSet(GlContext& context, std::shared_ptr<ViewLibrary> library, std::filesystem::path folder,
            ViewBasedOptions const& options, std::optional<BackEnd> back_end, int threads);

  std::shared_ptr<ViewLibrary> const& library() const { return library_; }
  ScanSet const& set() const { return library_->set(); }
  std::filesystem::path const& folder() const { return folder_; }
  ViewBasedRenderer& renderer() const { return *renderer_; }

  std::vector<BackEnd> back_ends() const;
  void draw_with(BackEnd back_end);
  Look look() const { return look_of(renderer_->options()); }
  void set_look(Look const& look);
  Look const& default_look() const { return default_look_; }
  double greatest_threshold() const;  ///< that is worth trying, in units

  /// Opens the folder anew where its files have changed; cheap where they have not. Whether it did; on failure all
  /// stays as it was, and `problem` says why. A threshold that was not touched follows the new error budget.
  enum class Reload { unchanged, done, failed };
  Reload follow_files(Context& context);
  std::string const& problem() const { return problem_; }

  /// Draws and keeps the frame. Views whose pictures are still being read are left out.
  ShownFrame const& render(PathCamera const& eye, int width, int height);
  ShownFrame const& shown() const { return shown_; }
  std::vector<UsedView> const& used() const { return used_; }  ///< in that frame
  /// Whether drawing again would show more: a picture that was missing has come. Once a picture.
  bool picture_has_come();
  SphereInset inset() const;

 private:
  std::unique_ptr<ViewBasedRenderer> make(BackEnd back_end, std::shared_ptr<ViewLibrary> const& library,
                                          ViewBasedOptions const& options) const;
  void learn_directions();

  using Make =
      std::function<std::unique_ptr<ViewBasedRenderer>(std::shared_ptr<ViewLibrary> const&, ViewBasedOptions const&)>;
  std::map<BackEnd, Make> back_ends_;
  std::filesystem::path folder_;
  ViewBasedOptions options_;  ///< as asked for: the threshold may be the budget's
  std::shared_ptr<ViewLibrary> library_;
  std::unique_ptr<ViewBasedRenderer> renderer_;
  Look default_look_;
  FileWatch watch_;
  std::string problem_;
  std::vector<Eigen::Vector3d> directions_;
  ShownFrame shown_;
  std::vector<UsedView> used_;
  std::size_t come_ = 0;  ///< of the used views, how many are read or failed
};

}  // namespace scanview

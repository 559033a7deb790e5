#pragma once
#include <memory>
#include <string>
#include <vector>

#include "acquire/scan_set.h"
#include "base/context.h"
#include "cli/node_source.h"
#include "viewer/select/camera_path.h"
#include "viewer/walkthrough/policy_figures.h"

namespace scanview {

/// Where the reference images of LDI trees come from.
class LdiSource {
 public:
  virtual ~LdiSource() = default;
  virtual Unit unit() const = 0;
  /// What depths of one surface may differ by (LdiOptions::depth_error).
  virtual double depth_error() const { return 0; }
  /// How many images there are, and how many are meant where nobody says.
  virtual int count() const = 0;
  virtual int usual_count() const { return count(); }
  /// So many of them, 1 to count(): of a sequence the first, of a set's views evenly spread ones.
  virtual std::vector<View> views(int count, Context& context) = 0;

  /// A path for the report, in pictures of this size (0: as large as the images), and what frames should look like: of
  /// the path's cameras, or of views that were held out, whatever the path. Throws Error{usage} where there is none.
  virtual std::vector<PathCamera> path(int frames, int width, int height) = 0;
  virtual std::vector<ReferenceFrame> references(std::vector<PathCamera> const& path, Context& context) = 0;
};

/// `scene`: "church" (ray traced; church_views.h) or "church:POLYGONS", a scan set's folder, or whatever
/// open_node_source() takes, of which each side of each node is an image. Throws Error{bad_input} where it is nothing
/// of these or views have no poses, Error{usage} for `--hold-out` of anything but a set.
std::unique_ptr<LdiSource> open_ldi_source(std::string const& scene, NodeSourceOptions const& options,
                                           Context& context);

}  // namespace scanview

#include "acquire/import_build.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "acquire/sampling_error.h"
#include "acquire/segment_background.h"
#include "acquire/segment_cut.h"
#include "acquire/segment_outliers.h"
#include "base/error.h"
#include "base/parallel.h"
#include "base/srgb.h"

namespace scanview {
namespace {

/// About so many depths decide the median of a whole set.
constexpr std::size_t kThinned = 1'000'000;

std::vector<float> thinned_depths(std::vector<View> const& views) {
  std::size_t total = 0;
  for (auto const& view : views) total += view.image.depth.total();
  std::size_t const stride = std::max<std::size_t>(1, total / kThinned);
  std::vector<float> values;
  std::size_t index = 0;
  for (auto const& view : views)
    for (float const value : view.image.depth)
      if (index++ % stride == 0 && std::isfinite(value)) values.push_back(value);
  return values;
}

double quantile(std::vector<float>& values, double share) {
  if (values.empty()) return 0;
  auto const at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

void check_sizes(RawView const& raw) {
  cv::Size const size(raw.camera.width(), raw.camera.height());
  auto const check = [&](cv::Mat const& image, char const* what) {
    if (!image.empty() && image.size() != size)
      throw Error(ErrorCode::bad_input, {},
                  fmt::format("{} is {}x{}, the camera {}x{}", what, image.cols, image.rows, size.width, size.height));
  };
  check(raw.depth, "depth");
  check(raw.color, "colour");
  check(raw.mask, "the mask");
  if (raw.depth.empty()) throw Error(ErrorCode::bad_input, {}, "no depth");
}

/// Depth out of range is cut, depth outside the mask is background; the rest is object.
View to_view(std::string const& name, RawView&& raw, ImportOptions const& options) {
  check_sizes(raw);
  View view;
  view.name = name;
  view.object_from_camera = raw.object_from_camera;
  view.image = empty_range_image(raw.camera);
  view.image.color = raw.color;
  for (int y = 0; y < raw.depth.rows; ++y)
    for (int x = 0; x < raw.depth.cols; ++x) {
      auto& pixel = view.image.classes(y, x);
      double const z = raw.depth(y, x);
      bool const seen = std::isfinite(z) && (z > 0 || !raw.camera.is_perspective());
      if (!raw.mask.empty() && raw.mask(y, x) == 0)
        pixel = static_cast<std::uint8_t>(PixelClass::background);
      else if (seen && (z < options.min_depth || z > options.max_depth))
        pixel = static_cast<std::uint8_t>(PixelClass::cut);
      else if (seen) {
        pixel = static_cast<std::uint8_t>(PixelClass::object);
        view.image.depth(y, x) = static_cast<float>(z);
      }
    }
  return view;
}

std::vector<View> load_views(BuildPlan const& plan, ImportOptions const& options, Context& context,
                             ImportResult& result) {
  std::vector<ViewSource const*> wanted;
  for (std::size_t i = 0; i < plan.views.size(); i += static_cast<std::size_t>(options.step))
    wanted.push_back(&plan.views[i]);
  std::vector<std::optional<View>> loaded(wanted.size());
  std::vector<std::string> problems(wanted.size());
  for_each_index(
      context, wanted.size(),
      [&](std::size_t i) {
        try {
          loaded[i] = to_view(wanted[i]->name, wanted[i]->load(), options);
        } catch (Error const& error) {
          if (error.code() != ErrorCode::bad_input && error.code() != ErrorCode::io) throw;
          problems[i] = error.what();
        }
      },
      "import");
  std::vector<View> views;
  std::string first_problem;
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    if (loaded[i]) {
      views.push_back(std::move(*loaded[i]));
      continue;
    }
    result.failed_views.push_back(wanted[i]->name);
    context.warn(fmt::format("view {} left out: {}", wanted[i]->name, problems[i]));
    if (first_problem.empty()) first_problem = problems[i];
  }
  if (views.empty())
    throw Error(ErrorCode::bad_input, plan.path,
                wanted.empty() ? "no views here"
                               : fmt::format("none of {} views can be read: {}", wanted.size(), first_problem));
  return views;
}

void give_sigma(ScanSet& set, BuildPlan const& plan, Context& context) {
  auto depths = thinned_depths(set.views);
  DepthNoise noise = plan.noise(quantile(depths, 0.5));
  std::vector<RangeImage const*> images;
  for (auto const& view : set.views) images.push_back(&view.image);
  noise.scale = estimate_noise_scale(images, noise);
  for_each_index(context, set.views.size(), [&](std::size_t i) { apply_noise(set.views[i].image, noise); });
}

void summarise(ImportResult& result) {
  auto& set = result.set;
  result.depths = 0;
  for (auto const& view : set.views) result.depths += view.image.count_depths();
  set.center = median_center(set);
  set.error_budget.sampling = sampling_error(set);
}

}  // namespace

ImportResult build_import(BuildPlan const& plan, ImportOptions const& options, Context& context) {
  options.validate();
  ImportResult result;
  auto& set = result.set;
  set.unit = plan.unit;
  set.views = load_views(plan, options, context, result);
  give_sigma(set, plan, context);
  for_each_index(context, set.views.size(), [&](std::size_t i) { remove_outliers(set.views[i].image); });
  for_each_index(context, set.views.size(), [&](std::size_t i) {
    auto& image = set.views[i].image;
    if (image.color.empty()) image.color = shade_by_normal(image);
  });
  // The ground first: once the background is gone the largest plane may be a side of the object.
  if (options.cut_ground && cut_ground(set, context.seed) == 0) context.warn("no ground plane found: nothing was cut");
  using Background = ImportOptions::Background;
  if (options.background == Background::remove_static ||
      (options.background == Background::automatic && plan.fixed_camera))
    result.background_removed = remove_static_background(set, context);
  if (options.box) cut_box(set, *options.box);
  for (auto const& view : set.views) view.image.check();
  summarise(result);
  if (result.depths == 0) context.warn("no depth is left in any view");
  return result;
}

cv::Mat3b shade_by_normal(RangeImage const& image) {
  cv::Mat3f const normals = estimate_normals(image);
  cv::Mat3b gray(image.depth.size(), cv::Vec3b(0, 0, 0));
  for (int y = 0; y < gray.rows; ++y)
    for (int x = 0; x < gray.cols; ++x) {
      if (!image.has_depth(x, y)) continue;
      auto const& n = normals(y, x);
      Eigen::Vector3d const towards = -image.camera.ray_direction(x, y).normalized();
      double const cosine =
          std::isfinite(n[0]) ? std::max(0.0, n[0] * towards.x() + n[1] * towards.y() + n[2] * towards.z()) : 0.5;
      double const linear = 0.05 + 0.75 * cosine;
      double const srgb = srgb_from_linear(linear);
      gray(y, x) = cv::Vec3b::all(static_cast<std::uint8_t>(std::lround(255 * srgb)));
    }
  return gray;
}

bool is_drawn_shading(RangeImage const& image) {
  if (image.color.empty()) return false;
  for (cv::Vec3b const& pixel : image.color)
    if (pixel[0] != pixel[1] || pixel[1] != pixel[2]) return false;
  cv::Mat3b const drawn = shade_by_normal(image);
  std::size_t alike = 0, all = 0;
  for (int y = 0; y < drawn.rows; ++y)
    for (int x = 0; x < drawn.cols; ++x) {
      if (!image.has_depth(x, y)) continue;
      ++all;
      alike += std::abs(drawn(y, x)[0] - image.color(y, x)[0]) <= 1;
    }
  return alike > 0.8 * static_cast<double>(all);  // what was cut away since changes normals beside it
}

std::string safe_view_name(std::string const& text) {
  std::string name;
  for (char const c : text) {
    bool const safe = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
                      c == '-' || (c == '.' && !name.empty());
    name += safe ? c : '_';
  }
  return name.empty() ? "view" : name;
}

std::vector<std::string> safe_view_names(std::vector<std::string> const& names) {
  std::vector<std::string> safe;
  std::set<std::string> taken;
  for (auto const& name : names) {
    std::string const stem = safe_view_name(name);
    std::string candidate = stem;
    for (int n = 2; !taken.insert(candidate).second; ++n) candidate = fmt::format("{}_{}", stem, n);
    safe.push_back(candidate);
  }
  return safe;
}

}  // namespace scanview

#include "register/pair_form.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

namespace scanview {
namespace {

constexpr double kTukey = 4.685;         // in standard deviations: 95 % efficient for normal noise
constexpr double kMinToneCosine = 0.35;  // beyond, the texture is smeared
constexpr double kMaxCorrelation = 0.8;  // beyond, it is misalignment that neighbours share, not noise
constexpr double kToneGate = 3.0;        // of `cost`, in scales
constexpr std::size_t kFigures = 15000;  // residuals of a direction that are kept

// A symmetric matrix as it is summed up, its upper half only.
class SymmetricSum {
 public:
  void add(double weight, Vector6d const& row) {
    for (int r = 0, k = 0; r < 6; ++r)
      for (int c = r; c < 6; ++c, ++k) half_[k] += weight * row[r] * row[c];
  }
  // The symmetric part of the product of two rows.
  void add(double weight, Vector6d const& row, Vector6d const& other) {
    for (int r = 0, k = 0; r < 6; ++r)
      for (int c = r; c < 6; ++c, ++k) half_[k] += weight / 2 * (row[r] * other[c] + other[r] * row[c]);
  }
  Matrix6d matrix() const {
    Matrix6d whole;
    for (int r = 0, k = 0; r < 6; ++r)
      for (int c = r; c < 6; ++c, ++k) whole(r, c) = whole(c, r) = half_[k];
    return whole;
  }

 private:
  double half_[21] = {};
};

// One view's contributions to the form, as they are summed up sample by sample.
struct Sums {
  SymmetricSum shape, tone;
  SymmetricSum shape_of_both;   // one normal from each view: unbiased by their noise
  SymmetricSum smooth_of_both;  // of it, without creases
  Vector6d shape_gradient = Vector6d::Zero(), tone_gradient = Vector6d::Zero();
  double smooth_weight = 0, normal_difference = 0, smooth_matched = 0;
  double cost = 0, cost_samples = 0;
  double tone_aa = 0, tone_bb = 0, tone_ab = 0;
};

Vector6d row_of(Eigen::Vector3d const& arm, Eigen::Vector3d const& direction, double radius) {
  Vector6d row;
  row << arm.cross(direction) / radius, direction;
  return row;
}

// Derivative of a pixel by the point in camera coordinates.
Eigen::Matrix<double, 2, 3> projection_derivative(Camera const& camera, Eigen::Vector3d const& p) {
  Eigen::Matrix<double, 2, 3> d;
  if (camera.is_perspective())
    d << camera.fx() / p.z(), 0, -camera.fx() * p.x() / (p.z() * p.z()),  //
        0, camera.fy() / p.z(), -camera.fy() * p.y() / (p.z() * p.z());
  else
    d << camera.fx(), 0, 0, 0, camera.fy(), 0;
  return d;
}

// Bilinear, NaN where a neighbour is.
template <typename Pixel>
Pixel bilinear(cv::Mat_<Pixel> const& image, Eigen::Vector2d const& at) {
  int const x = static_cast<int>(std::floor(at.x())), y = static_cast<int>(std::floor(at.y()));
  float const s = static_cast<float>(at.x() - x), t = static_cast<float>(at.y() - y);
  int const x1 = std::min(x + 1, image.cols - 1), y1 = std::min(y + 1, image.rows - 1);
  return (image(y, x) * (1 - s) + image(y, x1) * s) * (1 - t) + (image(y1, x) * (1 - s) + image(y1, x1) * s) * t;
}

// Takes the samples of `from` into `to`. Motions are those of view a in b's frame: `forward` says whether `from` is a.
void match_one_way(ViewSurface const& from, ViewSurface const& to, Eigen::Isometry3d const& b_from_a, bool forward,
                   MatchOptions const& options, PairForm& form, Sums& sums, std::size_t& asked, std::size_t& hits) {
  Eigen::Isometry3d const to_from_from = forward ? b_from_a : b_from_a.inverse();
  Eigen::Matrix3d const b_from_to =
      forward ? Eigen::Matrix3d(Eigen::Matrix3d::Identity()) : Eigen::Matrix3d(b_from_a.linear());
  bool const use_tone = options.use == MatchOptions::Use::shape_and_tone && !from.tone.empty() && !to.tone.empty();
  SampleGrid const grid(from, options.max_samples);
  bool const is_dense = grid.pitch() == 1;
  double const sign = forward ? 1 : -1;
  double const spread = options.geometry_scale * options.geometry_scale;
  // Scales need not be measured on all.
  std::size_t const noted = std::max<std::size_t>(1, from.samples.size() / kFigures);
  double last_shape = 0, last_tone = 0;
  SurfaceSample const* last = nullptr;
  bool last_has_tone = false;
  for (SurfaceSample const& sample : from.samples) {
    if ((sample.crease && !options.is_near) || !(is_dense || grid.contains(sample))) continue;
    ++asked;
    sums.cost_samples += 1;
    sums.cost += 1;
    Eigen::Vector3d const p = to_from_from * sample.point;
    SurfaceHit hit;
    if (!look_up(to, p, hit)) continue;
    Eigen::Vector3d const normal_from = to_from_from.linear() * sample.normal;
    if (hit.crease && !options.is_near) continue;
    if (normal_from.dot(hit.normal) < options.min_normal_cos) continue;
    double const distance = hit.normal.dot(p - hit.point);
    double const cosine = hit.cosine(to.camera);
    if (cosine < 0.05 || std::abs(distance) > options.gate * cosine) continue;
    ++hits;

    double const noise_from = sample.sigma * sample.cosine, noise_to = hit.sigma * cosine;
    double const floor = 0.02 * to.camera.pixel_size(hit.point.z());
    double const variance = noise_from * noise_from + noise_to * noise_to + floor * floor;
    double const in_sigmas = distance / std::sqrt(variance);
    if (hits % noted == 0) {
      form.geometry.values.push_back(static_cast<float>(in_sigmas));
      form.distances.push_back(static_cast<float>(distance));
    }

    // The sample's place in b's frame, where motions are measured.
    Eigen::Vector3d const arm = (forward ? p : sample.point) - form.center;
    Vector6d const row = sign * row_of(arm, b_from_to * hit.normal, options.radius);
    Vector6d const row_other = sign * row_of(arm, b_from_to * normal_from, options.radius);
    double const scaled = in_sigmas / options.geometry_scale;
    double const weight = tukey_weight(scaled) * options.geometry_share / (variance * spread);
    sums.shape.add(weight, row);
    sums.shape_of_both.add(weight, row, row_other);
    sums.shape_gradient += weight * distance * row;
    if (!sample.crease && !hit.crease) {
      sums.smooth_of_both.add(weight, row, row_other);
      sums.smooth_weight += weight;
      sums.normal_difference += (normal_from - hit.normal).squaredNorm();
      sums.smooth_matched += 1;
    }
    double const of_gate = distance / (options.gate * cosine);
    double cost = std::min(1.0, of_gate * of_gate);

    double const bounded = std::clamp(scaled, -3.0, 3.0);
    bool const adjacent = last != nullptr && last->y == sample.y && sample.x - last->x == grid.pitch();
    if (adjacent) {
      form.geometry.product += bounded * last_shape;
      form.geometry.square += (bounded * bounded + last_shape * last_shape) / 2;
    }
    last_shape = bounded;

    bool has_tone = false;
    if (use_tone && std::isfinite(sample.tone) && std::min<double>(cosine, sample.cosine) > kMinToneCosine) {
      float const tone_to = bilinear(to.tone, hit.pixel);
      cv::Vec2f const slope = bilinear(to.tone_gradient, hit.pixel);
      if (std::isfinite(tone_to) && std::isfinite(slope[0]) && std::isfinite(slope[1])) {
        has_tone = true;
        double const difference = tone_to - sample.tone;
        form.tone.values.push_back(static_cast<float>(difference));
        Eigen::RowVector3d const by_point =
            Eigen::RowVector2d(slope[0], slope[1]) * projection_derivative(to.camera, p);
        Vector6d const tone_row = sign * row_of(arm, b_from_to * by_point.transpose(), options.radius);
        double const tone_scaled = difference / options.tone_scale;
        double const tone_weight =
            tukey_weight(tone_scaled) * options.tone_share / (options.tone_scale * options.tone_scale);
        sums.tone.add(tone_weight, tone_row);
        sums.tone_gradient += tone_weight * difference * tone_row;
        sums.tone_aa += sample.tone * sample.tone;
        sums.tone_bb += tone_to * tone_to;
        sums.tone_ab += sample.tone * tone_to;
        if (adjacent && last_has_tone) {
          form.tone.product += std::clamp(tone_scaled, -3.0, 3.0) * last_tone;
          form.tone.square += (std::pow(std::clamp(tone_scaled, -3.0, 3.0), 2) + last_tone * last_tone) / 2;
        }
        last_tone = std::clamp(tone_scaled, -3.0, 3.0);
        cost = (cost + std::min(1.0, std::pow(tone_scaled / kToneGate, 2))) / 2;
      }
    }
    sums.cost += cost - 1;
    last_has_tone = has_tone;
    last = &sample;
  }
}

// The information and the gradient of the shapes without the motions that they do not constrain beyond the noise of
// their normals. Returns how many. With one normal from each view, noise neither holds a motion nor shortens a step;
// but from afar the two belong to different places. The normals of creases are wrong in both views alike, and would
// hold what the surface does not.
int hold_free_motions(Sums const& sums, bool is_near, Matrix6d& information, Vector6d& gradient) {
  if (!(sums.smooth_weight > 0)) {
    information.setZero();
    gradient.setZero();
    return 6;
  }
  Eigen::SelfAdjointEigenSolver<Matrix6d> const spectrum(sums.smooth_of_both.matrix() / sums.smooth_weight);
  double const normal_variance = sums.normal_difference / sums.smooth_matched / 4;  // an axis of one view's normals
  double const independent = std::max(1.0, sums.smooth_matched / 25);               // windows overlap
  double const noise = 4 * normal_variance / std::sqrt(independent);
  double const threshold = std::max(1e-5, noise);
  // A motion comes in gradually above the threshold, so that two linearisations do not take turns.
  Matrix6d root = Matrix6d::Zero(), share = Matrix6d::Zero();
  int held = 0;
  for (int k = 0; k < 6; ++k) {
    double const trust = std::clamp(spectrum.eigenvalues()[k] / threshold - 1, 0.0, 2.0) / 2;
    if (trust == 0) ++held;
    Matrix6d const outer = spectrum.eigenvectors().col(k) * spectrum.eigenvectors().col(k).transpose();
    root += std::sqrt(trust) * outer;
    share += trust * outer;
  }
  information = root * (is_near ? sums.shape_of_both : sums.shape).matrix() * root;
  gradient = share * gradient;
  return held;
}

}  // namespace

Eigen::Isometry3d motion(Vector6d const& twist, Eigen::Vector3d const& center, double radius) {
  Eigen::Vector3d const w = twist.head<3>() / radius;
  double const angle = w.norm();
  Eigen::Isometry3d result = Eigen::Isometry3d::Identity();
  if (angle > 0) result.linear() = Eigen::AngleAxisd(angle, w / angle).toRotationMatrix();
  result.translation() = center + twist.tail<3>() - result.linear() * center;
  return result;
}

Vector6d twist_of(Eigen::Isometry3d const& motion, Eigen::Vector3d const& center, double radius) {
  Eigen::AngleAxisd const turn(Eigen::Quaterniond(motion.linear()));
  Vector6d twist;
  twist << turn.angle() * turn.axis() * radius, motion * center - center;
  return twist;
}

double motion_difference(Eigen::Isometry3d const& l, Eigen::Isometry3d const& r, Eigen::Vector3d const& centroid,
                         double radius) {
  double largest = 0;
  for (Eigen::Vector3d const& offset :
       {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(radius, 0, 0), Eigen::Vector3d(0, radius, 0)})
    largest = std::max(largest, (l * (centroid + offset) - r * (centroid + offset)).norm());
  return largest;
}

bool look_up(ViewSurface const& surface, Eigen::Vector3d const& p, SurfaceHit& hit) {
  Camera const& camera = surface.camera;
  bool const inverse = camera.is_perspective();
  if (inverse && !(p.z() > 0)) return false;
  double const scale = inverse ? 1 / p.z() : 1;
  double const u = camera.fx() * p.x() * scale + camera.cx(), v = camera.fy() * p.y() * scale + camera.cy();
  int const width = camera.width(), height = camera.height();
  if (!(u >= 0 && v >= 0 && u <= width - 1 && v <= height - 1)) return false;
  int const x = static_cast<int>(u), y = static_cast<int>(v);
  float const s = static_cast<float>(u - x), t = static_cast<float>(v - y);
  std::size_t const right = x + 1 < width ? 1 : 0, down = y + 1 < height ? static_cast<std::size_t>(width) : 0;
  SurfacePixel const* const p00 = &surface.at(x, y);
  SurfacePixel const &p10 = p00[right], &p01 = p00[down], &p11 = p00[down + right];
  float const w00 = (1 - s) * (1 - t), w10 = s * (1 - t), w01 = (1 - s) * t, w11 = s * t;
  double const chord = static_cast<double>(w00) * p00->linear_depth + static_cast<double>(w10) * p10.linear_depth +
                       static_cast<double>(w01) * p01.linear_depth + static_cast<double>(w11) * p11.linear_depth;
  if (!std::isfinite(chord)) return false;
  SurfacePixel const& nearest = p00[(s >= 0.5f ? right : 0) + (t >= 0.5f ? down : 0)];
  double const linear = chord - (s * (1 - s) * nearest.bend_u + t * (1 - t) * nearest.bend_v) / 2;
  Eigen::Vector3d n;
  for (int k = 0; k < 3; ++k)
    n[k] = w00 * p00->normal[k] + w10 * p10.normal[k] + w01 * p01.normal[k] + w11 * p11.normal[k];
  hit.normal = n / n.norm();
  hit.pixel = {u, v};
  double const z = inverse ? 1 / linear : linear, of_ray = inverse ? z : 1;
  hit.point = {(u - camera.cx()) / camera.fx() * of_ray, (v - camera.cy()) / camera.fy() * of_ray, z};
  hit.sigma = nearest.sigma;
  hit.crease = nearest.crease;
  return true;
}

double tukey_weight(double residual_in_scales) {
  double const t = residual_in_scales / kTukey;
  return std::abs(t) < 1 ? (1 - t * t) * (1 - t * t) : 0;
}

double robust_scale(std::vector<float>& values) {
  if (values.empty()) return 0;
  for (float& value : values) value = std::abs(value);
  auto const middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return 1.4826 * *middle;
}

double effective_share(double correlation) {
  double const c = std::clamp(correlation, 0.0, kMaxCorrelation);
  return std::pow((1 - c) / (1 + c), 2);
}

PairForm match_pair(ViewSurface const& a, ViewSurface const& b, Eigen::Isometry3d const& b_from_a,
                    Eigen::Vector3d const& centroid_a, Eigen::Vector3d const& centroid_b, MatchOptions const& options) {
  PairForm form;
  form.center = (b_from_a * centroid_a + centroid_b) / 2;
  Sums sums;
  match_one_way(a, b, b_from_a, true, options, form, sums, form.asked_ab, form.hits_ab);
  match_one_way(b, a, b_from_a, false, options, form, sums, form.asked_ba, form.hits_ba);
  // Where every pixel is taken into the other view and every pixel there comes back, each one's noise counts twice.
  bool const is_dense =
      SampleGrid(a, options.max_samples).pitch() == 1 && SampleGrid(b, options.max_samples).pitch() == 1;
  form.cost = sums.cost_samples > 0 ? sums.cost / sums.cost_samples : 1;
  if (form.hits_ab + form.hits_ba > 0) {
    form.information = sums.shape.matrix();
    form.gradient = sums.shape_gradient;
    if (options.hold_free_motions)
      form.held = hold_free_motions(sums, options.is_near, form.information, form.gradient);
  } else {
    form.held = 6;
  }
  if (sums.tone_aa > 0 && sums.tone_bb > 0)
    form.tone_correlation = sums.tone_ab / std::sqrt(sums.tone_aa * sums.tone_bb);
  // Tones that do not resemble each other say nothing, however strong their gradients: noise, or another surface.
  double const trust = std::clamp((form.tone_correlation - 0.2) / 0.3, 0.0, 1.0);
  if (trust > 0) {
    form.information += trust * sums.tone.matrix();
    form.gradient += trust * sums.tone_gradient;
    if (form.held < 6) form.held = 0;
  }
  if (is_dense) {
    form.information /= 2;
    form.gradient /= 2;
  }
  return form;
}

std::vector<bool> seen_samples(ViewSurface const& from, ViewSurface const& to, Eigen::Isometry3d const& to_from_from,
                               MatchOptions const& options) {
  SampleGrid const grid(from, options.max_samples);
  std::vector<bool> seen;
  for (SurfaceSample const& sample : from.samples) {
    if (!grid.contains(sample)) continue;
    SurfaceHit hit;
    Eigen::Vector3d const p = to_from_from * sample.point;
    seen.push_back(look_up(to, p, hit) &&
                   (to_from_from.linear() * sample.normal).dot(hit.normal) >= options.min_normal_cos &&
                   std::abs(p.z() - hit.point.z()) <= options.gate);
  }
  return seen;
}

}  // namespace scanview

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

// One view's contributions to the form, as they are summed up sample by sample.
struct Sums {
  Matrix6d shape = Matrix6d::Zero(), tone = Matrix6d::Zero();
  Matrix6d shape_of_both = Matrix6d::Zero();  // one normal from each view: unbiased by their noise
  Vector6d shape_gradient = Vector6d::Zero(), tone_gradient = Vector6d::Zero();
  double shape_weight = 0, normal_difference = 0, matched = 0;
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
  double const sign = forward ? 1 : -1;
  double last_shape = 0, last_tone = 0;
  SurfaceSample const* last = nullptr;
  bool last_has_tone = false;
  for (SurfaceSample const& sample : from.samples) {
    if (!grid.contains(sample) || sample.crease) continue;
    ++asked;
    sums.cost_samples += 1;
    sums.cost += 1;
    Eigen::Vector3d const p = to_from_from * sample.point;
    SurfaceHit hit;
    if (!look_up(to, p, hit)) continue;
    Eigen::Vector3d const normal_from = to_from_from.linear() * sample.normal;
    if (hit.crease || normal_from.dot(hit.normal) < options.min_normal_cos) continue;
    double const distance = hit.normal.dot(p - hit.point);
    Eigen::Vector3d const ray = to.camera.ray_direction(hit.pixel.x(), hit.pixel.y()).normalized();
    double const cosine = -hit.normal.dot(ray);
    if (cosine < 0.05 || std::abs(distance) > options.gate * cosine) continue;
    ++hits;

    double const cosine_from = -sample.normal.dot(from.camera.ray_direction(sample.x, sample.y).normalized());
    double const noise_from = sample.sigma * cosine_from, noise_to = hit.sigma * cosine;
    double const floor = 0.02 * to.camera.pixel_size(hit.point.z());
    double const sigma = std::sqrt(noise_from * noise_from + noise_to * noise_to + floor * floor);
    double const in_sigmas = distance / sigma;
    form.geometry.values.push_back(static_cast<float>(in_sigmas));
    form.distances.push_back(static_cast<float>(distance));

    // The sample's place in b's frame, where motions are measured.
    Eigen::Vector3d const arm = (forward ? p : sample.point) - form.center;
    Vector6d const row = sign * row_of(arm, b_from_to * hit.normal, options.radius);
    Vector6d const row_other = sign * row_of(arm, b_from_to * normal_from, options.radius);
    double const scaled = in_sigmas / options.geometry_scale;
    double const weight = tukey_weight(scaled) * options.geometry_share / std::pow(sigma * options.geometry_scale, 2);
    sums.shape += weight * row * row.transpose();
    sums.shape_of_both += weight / 2 * (row * row_other.transpose() + row_other * row.transpose());
    sums.shape_gradient += weight * distance * row;
    sums.shape_weight += weight;
    sums.normal_difference += (normal_from - hit.normal).squaredNorm();
    sums.matched += 1;
    double cost = std::min(1.0, std::pow(distance / (options.gate * cosine), 2));

    bool const adjacent = last != nullptr && last->y == sample.y && sample.x - last->x == grid.pitch();
    if (adjacent) {
      form.geometry.product += std::clamp(scaled, -3.0, 3.0) * last_shape;
      form.geometry.square += (std::pow(std::clamp(scaled, -3.0, 3.0), 2) + last_shape * last_shape) / 2;
    }
    last_shape = std::clamp(scaled, -3.0, 3.0);

    bool has_tone = false;
    if (use_tone && std::isfinite(sample.tone) && std::min(cosine, cosine_from) > kMinToneCosine) {
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
        sums.tone += tone_weight * tone_row * tone_row.transpose();
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

// Takes out the motions that the shapes do not constrain beyond the noise of their normals. Returns how many.
int hold_free_motions(Sums const& sums, Matrix6d& information, Vector6d& gradient) {
  if (!(sums.shape_weight > 0)) return 6;
  Eigen::SelfAdjointEigenSolver<Matrix6d> const spectrum(sums.shape_of_both / sums.shape_weight);
  double const normal_variance = sums.normal_difference / sums.matched / 4;  // an axis of one view's normals
  double const independent = std::max(1.0, sums.matched / 25);               // windows overlap
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
  information = root * information * root;
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
  if (surface.camera.is_perspective() && !(p.z() > 0)) return false;
  hit.pixel = surface.camera.project(p);
  if (!(hit.pixel.x() >= 0 && hit.pixel.y() >= 0 && hit.pixel.x() <= surface.depth.cols - 1 &&
        hit.pixel.y() <= surface.depth.rows - 1))
    return false;
  float const z = bilinear(surface.depth, hit.pixel);
  if (!std::isfinite(z)) return false;
  cv::Vec3f const n = bilinear(surface.normal, hit.pixel);
  hit.normal = Eigen::Vector3d(n[0], n[1], n[2]).normalized();
  hit.point = surface.camera.unproject(hit.pixel.x(), hit.pixel.y(), z);
  int const x = static_cast<int>(std::lround(hit.pixel.x())), y = static_cast<int>(std::lround(hit.pixel.y()));
  hit.sigma = surface.sigma(y, x);
  hit.crease = surface.crease(y, x) != 0;
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
  form.cost = sums.cost_samples > 0 ? sums.cost / sums.cost_samples : 1;
  if (sums.matched > 0) {
    form.information = sums.shape;
    form.gradient = sums.shape_gradient;
    if (options.hold_free_motions) form.held = hold_free_motions(sums, form.information, form.gradient);
  } else {
    form.held = 6;
  }
  if (sums.tone_aa > 0 && sums.tone_bb > 0)
    form.tone_correlation = sums.tone_ab / std::sqrt(sums.tone_aa * sums.tone_bb);
  // Tones that do not resemble each other say nothing, however strong their gradients: noise, or another surface.
  double const trust = std::clamp((form.tone_correlation - 0.2) / 0.3, 0.0, 1.0);
  if (trust > 0) {
    form.information += trust * sums.tone;
    form.gradient += trust * sums.tone_gradient;
    if (form.held < 6) form.held = 0;
  }
  return form;
}

PairOverlap measure_overlap(ViewSurface const& a, ViewSurface const& b, Eigen::Isometry3d const& b_from_a,
                            MatchOptions const& options) {
  auto const one_way = [&](ViewSurface const& from, ViewSurface const& to, Eigen::Isometry3d const& to_from_from,
                           std::size_t& hits) {
    SampleGrid const grid(from, options.max_samples);
    std::size_t asked = 0, met = 0;
    for (SurfaceSample const& sample : from.samples) {
      if (!grid.contains(sample)) continue;
      ++asked;
      SurfaceHit hit;
      Eigen::Vector3d const p = to_from_from * sample.point;
      if (!look_up(to, p, hit)) continue;
      if ((to_from_from.linear() * sample.normal).dot(hit.normal) < options.min_normal_cos) continue;
      if (std::abs(p.z() - hit.point.z()) <= options.gate) ++met;
    }
    hits += met;
    return asked > 0 ? static_cast<double>(met) / static_cast<double>(asked) : 0.0;
  };
  PairOverlap overlap;
  overlap.ab = one_way(a, b, b_from_a, overlap.hits);
  overlap.ba = one_way(b, a, b_from_a.inverse(), overlap.hits);
  return overlap;
}

}  // namespace scanview

#include "register/pcl_parts.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <opencv2/core.hpp>

namespace scanview {
namespace {

constexpr double kRounding = 1e-7;   // radii: what floats leave of a point
constexpr double kLeastScale = 0.1;  // of the residuals in sigmas: the step of a perfect fit has no weights else

bool is_at_outline(ViewSurface const& surface, SurfaceSample const& sample, int pitch) {
  int const reach = std::max(2, pitch);
  for (auto const& [dx, dy] : {std::pair{-reach, 0}, {reach, 0}, {0, -reach}, {0, reach}}) {
    int const x = sample.x + dx, y = sample.y + dy;
    if (x < 0 || y < 0 || x >= surface.camera.width() || y >= surface.camera.height()) return true;
    if (!surface.has_surface(x, y)) return true;
  }
  return false;
}

pcl::Correspondences in_order(pcl::Indices const& of_source, pcl::Indices const& of_target) {
  pcl::Correspondences all;
  for (std::size_t i = 0; i < std::min(of_source.size(), of_target.size()); ++i)
    all.emplace_back(of_source[i], of_target[i], 0.0f);
  return all;
}

pcl::Indices all_of(PclCloud const& cloud) {
  pcl::Indices indices(cloud.size());
  std::iota(indices.begin(), indices.end(), 0);
  return indices;
}

}  // namespace

Eigen::Isometry3d PclFrame::camera_motion(Eigen::Matrix4f const& motion_of_cloud) const {
  Eigen::Isometry3d result = Eigen::Isometry3d::Identity();
  // Floats leave a rotation that is none to 1e-7.
  result.linear() =
      Eigen::Quaterniond(Eigen::Matrix3d(motion_of_cloud.topLeftCorner<3, 3>().cast<double>())).normalized().matrix();
  result.translation() =
      origin + radius * motion_of_cloud.topRightCorner<3, 1>().cast<double>() - result.linear() * origin;
  return result;
}

PclFrame pcl_frame_of(ViewSurface const& target, double radius) {
  PclFrame frame{Eigen::Vector3d::Zero(), radius};
  for (SurfaceSample const& sample : target.samples) frame.origin += sample.point;
  frame.origin /= static_cast<double>(target.samples.size());
  return frame;
}

PclView make_pcl_view(ViewSurface const& surface, Eigen::Isometry3d const& target_from_camera, PclFrame const& frame,
                      std::size_t max_samples) {
  PclView view;
  SampleGrid const grid(surface, max_samples);
  for (SurfaceSample const& sample : surface.samples) {
    if (!grid.contains(sample)) continue;
    pcl::PointNormal point;
    point.getVector3fMap() = ((target_from_camera * sample.point - frame.origin) / frame.radius).cast<float>();
    point.getNormalVector3fMap() = (target_from_camera.linear() * sample.normal).cast<float>();
    point.curvature = static_cast<float>(sample.sigma * sample.cosine / frame.radius);
    view.cloud->push_back(point);
    view.at_outline.push_back(is_at_outline(surface, sample, grid.pitch()));
  }
  return view;
}

ProjectiveCorrespondence::ProjectiveCorrespondence(ViewSurface const& surface, PclFrame const& frame)
    : surface_(&surface), frame_(frame) {
  corr_name_ = "ProjectiveCorrespondence";
}

void ProjectiveCorrespondence::index_target() {
  if (!target_cloud_updated_ && !index_.empty()) return;
  auto const& camera = surface_->camera;
  index_ = cv::Mat1i(camera.height(), camera.width(), -1);
  for (std::size_t i = 0; i < target_->size(); ++i) {
    Eigen::Vector2d const pixel = camera.project(frame_.camera_from_cloud((*target_)[i]));
    int const x = static_cast<int>(std::lround(pixel.x())), y = static_cast<int>(std::lround(pixel.y()));
    if (x >= 0 && y >= 0 && x < index_.cols && y < index_.rows) index_(y, x) = static_cast<int>(i);
  }
  auto const pixels = static_cast<double>(std::count_if(surface_->pixels.begin(), surface_->pixels.end(),
                                                        [](SurfacePixel const& p) { return p.has_surface(); }));
  double const points = static_cast<double>(std::max<std::size_t>(1, target_->size()));
  reach_ = static_cast<int>(std::ceil(std::sqrt(pixels / points))) / 2;
  target_cloud_updated_ = false;
}

int ProjectiveCorrespondence::target_at(Eigen::Vector2d const& pixel) const {
  int const x = static_cast<int>(std::lround(pixel.x())), y = static_cast<int>(std::lround(pixel.y()));
  int found = -1;
  double least = std::numeric_limits<double>::infinity();
  for (int v = std::max(0, y - reach_); v <= std::min(index_.rows - 1, y + reach_); ++v)
    for (int u = std::max(0, x - reach_); u <= std::min(index_.cols - 1, x + reach_); ++u) {
      double const distance = std::hypot(u - pixel.x(), v - pixel.y());
      if (index_(v, u) < 0 || distance >= least) continue;
      least = distance;
      found = index_(v, u);
    }
  return found;
}

void ProjectiveCorrespondence::determineCorrespondences(pcl::Correspondences& correspondences, double max_distance) {
  correspondences.clear();
  if (!target_ || !PCLBase<pcl::PointNormal>::initCompute()) return;
  index_target();
  for (pcl::index_t const i : *indices_) {
    pcl::PointNormal const& point = (*input_)[static_cast<std::size_t>(i)];
    SurfaceHit hit;
    if (!look_up(*surface_, frame_.camera_from_cloud(point), hit)) continue;
    int const match = target_at(hit.pixel);
    if (match < 0) continue;
    float const squared = (point.getVector3fMap() - (*target_)[static_cast<std::size_t>(match)].getVector3fMap())
                              .squaredNorm();  // as PCL's own give it
    if (static_cast<double>(squared) <= max_distance * max_distance) correspondences.emplace_back(i, match, squared);
  }
  deinitCompute();
}

void ProjectiveCorrespondence::determineReciprocalCorrespondences(pcl::Correspondences& correspondences,
                                                                  double max_distance) {
  determineCorrespondences(correspondences, max_distance);
  std::vector<float> least(target_ ? target_->size() : 0, std::numeric_limits<float>::infinity());
  for (pcl::Correspondence const& c : correspondences) {
    float& nearest = least[static_cast<std::size_t>(c.index_match)];
    nearest = std::min(nearest, c.distance);
  }
  std::erase_if(correspondences, [&](pcl::Correspondence const& c) {
    return c.distance > least[static_cast<std::size_t>(c.index_match)];
  });
}

OutlineRejector::OutlineRejector(std::vector<bool> target_at_outline)
    : target_at_outline_(std::move(target_at_outline)) {
  rejection_name_ = "OutlineRejector";
}

void OutlineRejector::getRemainingCorrespondences(pcl::Correspondences const& original,
                                                  pcl::Correspondences& remaining) {
  pcl::Correspondences kept;
  for (pcl::Correspondence const& c : original)
    if (!target_at_outline_.at(static_cast<std::size_t>(c.index_match))) kept.push_back(c);
  remaining = std::move(kept);
}

void OutlineRejector::applyRejection(pcl::Correspondences& correspondences) {
  getRemainingCorrespondences(*input_correspondences_, correspondences);
}

SigmaWeightedPlaneEstimation::Step SigmaWeightedPlaneEstimation::step(
    PclCloud const& source, PclCloud const& target, pcl::Correspondences const& correspondences) const {
  std::vector<double> sigmas, distances;
  std::vector<float> in_sigmas;
  std::vector<Vector6d> rows;
  for (pcl::Correspondence const& c : correspondences) {
    pcl::PointNormal const &from = source[static_cast<std::size_t>(c.index_query)],
                           &to = target[static_cast<std::size_t>(c.index_match)];
    Eigen::Vector3d const p = from.getVector3fMap().cast<double>(), n = to.getNormalVector3fMap().cast<double>();
    Vector6d row;
    row << p.cross(n), n;
    double const sigma = std::sqrt(std::pow(from.curvature, 2) + std::pow(to.curvature, 2) + kRounding * kRounding);
    double const distance = n.dot(p - to.getVector3fMap().cast<double>());
    if (!std::isfinite(sigma) || !std::isfinite(distance)) continue;
    rows.push_back(row);
    sigmas.push_back(sigma);
    distances.push_back(distance);
    in_sigmas.push_back(static_cast<float>(distance / sigma));
  }
  Step step;
  std::vector<float> sorted = in_sigmas;
  double const scale = std::max(kLeastScale, robust_scale(sorted));
  Vector6d gradient = Vector6d::Zero();
  double weights = 0;
  for (std::size_t i = 0; i < rows.size(); ++i) {
    double const weight = tukey_weight(in_sigmas[i] / scale) / (sigmas[i] * sigmas[i]);
    step.information += weight * rows[i] * rows[i].transpose();
    gradient += weight * distances[i] * rows[i];
    weights += weight;
  }
  if (!(weights > 0)) return step;
  Eigen::SelfAdjointEigenSolver<Matrix6d> const spectrum(step.information / weights);
  step.information.setZero();
  for (int k = 0; k < 6; ++k) {
    double const held = spectrum.eigenvalues()[k];
    if (held < kFreeMotion) continue;
    Vector6d const direction = spectrum.eigenvectors().col(k);
    step.twist -= direction * (direction.dot(gradient) / weights / held);
    step.information += held * direction * direction.transpose();
  }
  return step;
}

void SigmaWeightedPlaneEstimation::estimateRigidTransformation(PclCloud const& source, PclCloud const& target,
                                                               pcl::Correspondences const& correspondences,
                                                               Matrix4& result) const {
  result = motion(step(source, target, correspondences).twist, Eigen::Vector3d::Zero(), 1).matrix().cast<float>();
}

void SigmaWeightedPlaneEstimation::estimateRigidTransformation(PclCloud const& source, PclCloud const& target,
                                                               Matrix4& result) const {
  estimateRigidTransformation(source, target, in_order(all_of(source), all_of(target)), result);
}

void SigmaWeightedPlaneEstimation::estimateRigidTransformation(PclCloud const& source, pcl::Indices const& of_source,
                                                               PclCloud const& target, Matrix4& result) const {
  estimateRigidTransformation(source, target, in_order(of_source, all_of(target)), result);
}

void SigmaWeightedPlaneEstimation::estimateRigidTransformation(PclCloud const& source, pcl::Indices const& of_source,
                                                               PclCloud const& target, pcl::Indices const& of_target,
                                                               Matrix4& result) const {
  estimateRigidTransformation(source, target, in_order(of_source, of_target), result);
}

}  // namespace scanview

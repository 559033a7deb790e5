#include "register/shape_features.h"

#include <pcl/features/fpfh.h>
#include <pcl/point_cloud.h>
#include <pcl/point_types.h>

#include <algorithm>
#include <cmath>
#include <numeric>

namespace scanview {
namespace {

using Cloud = pcl::PointCloud<pcl::PointNormal>;

constexpr double kKept = 2.0 / 3;
constexpr std::size_t kFewest = 20;

// In radii, so that PCL's floats suffice whatever the unit.
Cloud::Ptr cloud_of(ViewSurface const& surface, SampleGrid const& grid, double radius) {
  Cloud::Ptr cloud(new Cloud);
  for (SurfaceSample const& sample : surface.samples) {
    if (!grid.contains(sample)) continue;
    pcl::PointNormal point;
    point.getVector3fMap() = (sample.point / radius).cast<float>();
    point.getNormalVector3fMap() = sample.normal.cast<float>();
    cloud->push_back(point);
  }
  return cloud;
}

}  // namespace

Features find_shape_features(ViewSurface const& surface, ShapeFeatureOptions const& options) {
  Features features;
  Cloud::Ptr const around = cloud_of(surface, SampleGrid(surface, options.max_surface), options.radius);
  SampleGrid const grid(surface, options.max_features);
  Cloud::Ptr const points = cloud_of(surface, grid, options.radius);
  if (points->size() < kFewest) return features;
  pcl::FPFHEstimation<pcl::PointNormal, pcl::PointNormal, pcl::FPFHSignature33> estimation;
  estimation.setInputCloud(points);
  estimation.setSearchSurface(around);
  estimation.setInputNormals(around);
  estimation.setRadiusSearch(options.neighbourhood);
  pcl::PointCloud<pcl::FPFHSignature33> signatures;
  estimation.compute(signatures);

  constexpr int kBins = 33;
  cv::Mat1f rows(static_cast<int>(signatures.size()), kBins);
  cv::Mat1f mean(1, kBins, 0.0F);
  for (int i = 0; i < rows.rows; ++i) {
    float const* const bins = signatures[static_cast<std::size_t>(i)].histogram;
    float const sum = std::accumulate(bins, bins + kBins, 0.0F);
    for (int k = 0; k < kBins; ++k) rows(i, k) = sum > 0 ? std::sqrt(std::max(bins[k], 0.0F) / sum) : 0.0F;
    mean += rows.row(i) / rows.rows;
  }
  std::vector<std::pair<float, int>> usual;
  for (int i = 0; i < rows.rows; ++i) {
    auto const product = static_cast<float>(rows.row(i).dot(mean));
    if (product > 0) usual.emplace_back(product, i);
  }
  std::sort(usual.begin(), usual.end());
  usual.resize(static_cast<std::size_t>(kKept * static_cast<double>(usual.size())));
  std::vector<SurfaceSample const*> samples;
  for (SurfaceSample const& sample : surface.samples)
    if (grid.contains(sample)) samples.push_back(&sample);
  for (auto const& [product, i] : usual) {
    SurfaceSample const& sample = *samples[static_cast<std::size_t>(i)];
    features.points.push_back(sample.point);
    features.normals.push_back(sample.normal);
    features.descriptors.push_back(rows.row(i));
  }
  return features;
}

}  // namespace scanview

#include "synth/patch_writer.h"

#include <algorithm>
#include <cmath>

namespace scanview {

void PatchWriter::add(Patch const& patch) {
  bool const is_around = patch.closed == Patch::Closed::around;
  bool const has_first = patch.pole == Patch::Pole::first || patch.pole == Patch::Pole::both;
  bool const has_last = patch.pole == Patch::Pole::last || patch.pole == Patch::Pole::both;
  int const across = is_around ? patch.columns : patch.columns + 1;
  std::size_t const cells = static_cast<std::size_t>(patch.columns) * patch.rows;
  triangles_ += 2 * cells - static_cast<std::size_t>((has_first + has_last) * patch.columns);
  vertices_ += static_cast<std::size_t>(across) * (patch.rows + 1);
  if (!mesh_) return;
  auto const first = static_cast<int>(mesh_->vertices.size());
  for (int row = 0; row <= patch.rows; ++row)
    for (int column = 0; column < across; ++column) {
      mesh_->vertices.push_back(patch.point(column, row).cast<float>());
      mesh_->colors.push_back(patch.color);
    }
  for (int row = 0; row < patch.rows; ++row)
    for (int column = 0; column < patch.columns; ++column) {
      int const next = is_around && column + 1 == patch.columns ? 0 : column + 1;
      int const a = first + row * across + column, b = first + row * across + next, c = b + across, d = a + across;
      if (!has_first || row > 0) mesh_->triangles.emplace_back(a, b, c);
      if (!has_last || row + 1 < patch.rows) mesh_->triangles.emplace_back(a, c, d);
    }
}

int PatchWriter::steps(double length, int least) const {
  return std::max(least, static_cast<int>(std::lround(length / edge_)));
}

std::vector<std::vector<double>> PatchWriter::divided(std::vector<double> const& lines) const {
  std::vector<std::vector<double>> ways;
  for (std::size_t i = 0; i + 1 < lines.size(); ++i) {
    double const from = lines[i], to = lines[i + 1];
    // Counted from the start, so that ways of equal length are not all divided more finely at once.
    auto const marks_before = [&](double at) { return std::lround((at - lines.front()) / edge_); };
    int const count = std::max(1, static_cast<int>(marks_before(to) - marks_before(from)));
    std::vector<double> way;
    for (int k = 0; k < count; ++k) way.push_back(from + (to - from) * k / count);
    way.push_back(to);
    ways.push_back(std::move(way));
  }
  return ways;
}

TriangleMesh mesh_of_about(std::size_t polygons, std::function<void(PatchWriter&)> const& write) {
  auto const count_triangles = [&](double edge) {
    PatchWriter writer(edge);
    write(writer);
    return writer.triangles();
  };
  auto const away = [&](std::size_t count) {
    return std::abs(static_cast<double>(count) - static_cast<double>(polygons));
  };
  double fine = 1e-3, coarse = 4, best = fine;
  std::size_t best_count = 0;
  for (int i = 0; i < 40; ++i) {
    double const edge = std::sqrt(fine * coarse);
    std::size_t const count = count_triangles(edge);
    if (best_count == 0 || away(count) < away(best_count)) {
      best = edge;
      best_count = count;
    }
    (count > polygons ? fine : coarse) = edge;
  }
  PatchWriter counter(best);
  write(counter);
  TriangleMesh mesh;
  mesh.triangles.reserve(counter.triangles());
  mesh.vertices.reserve(counter.vertices());
  mesh.colors.reserve(counter.vertices());
  PatchWriter writer(best, &mesh);
  write(writer);
  return mesh;
}

}  // namespace scanview

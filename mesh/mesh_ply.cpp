#include "mesh/mesh_ply.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "mesh/model_builder.h"
#include "mesh/ply_textures.h"

namespace scanview {
namespace {

PlyProperty const* find_list(PlyElement const& element) {
  for (char const* name : {"vertex_indices", "vertex_index"}) {
    PlyProperty const* const property = element.find(name);
    if (property && property->is_list) return property;
  }
  return nullptr;
}

/// Values of a property that holds indices.
std::vector<std::int64_t> indices_of(PlyProperty const& lists, ModelBuilder const& builder) {
  std::vector<std::int64_t> indices;
  indices.reserve(lists.values.size());
  for (double const value : lists.values) {
    if (!(std::abs(value) < 1e18)) builder.fail("a face with an index that is no number");
    indices.push_back(std::int64_t(value));
  }
  return indices;
}

/// Where light passes: an `alpha` of less than the whole.
class Alpha {
 public:
  explicit Alpha(PlyElement const& element) : property_(element.find("alpha")) {
    if (!property_) return;
    auto const greatest = std::max_element(property_->values.begin(), property_->values.end());
    bool const is_real = property_->type == PlyType::float32 || property_->type == PlyType::float64;
    if (property_->is_list || greatest == property_->values.end())
      property_ = nullptr;
    else if (property_->type == PlyType::uint16)
      whole_ = 65535;
    else if (is_real && *greatest <= 1)
      whole_ = 1;
    all_zero_ = property_ && *greatest == 0;
  }
  Light at(std::size_t row) const {
    return property_ && !all_zero_ && property_->values[row] < whole_ ? Light::passes : Light::stops;
  }
  /// Some programs leave it at 0 where they mean nothing by it.
  bool all_zero() const { return all_zero_; }

 private:
  PlyProperty const* property_;
  double whole_ = 255;
  bool all_zero_ = false;
};

}  // namespace

PolygonModel model_from_ply(PlyFile const& ply, std::filesystem::path const& path) {
  ModelBuilder builder(path);
  PlyElement const* const vertices = ply.find("vertex");
  if (!vertices) builder.fail("no element 'vertex'");
  std::array<PlyProperty const*, 3> position{}, color{};
  constexpr char const* position_names[] = {"x", "y", "z"};
  constexpr char const* color_names[] = {"blue", "green", "red"};
  bool has_color = true;
  for (int i = 0; i < 3; ++i) {
    position[i] = vertices->find(position_names[i]);
    if (!position[i] || position[i]->is_list) builder.fail(fmt::format("vertices without '{}'", position_names[i]));
    color[i] = vertices->find(color_names[i]);
    has_color = has_color && color[i] && !color[i]->is_list && color[i]->type == PlyType::uint8;
  }
  auto const alpha_of = [&](PlyElement const& element) {
    Alpha alpha(element);
    if (alpha.all_zero()) builder.note(fmt::format("every {} has alpha 0: taken for opaque", element.name));
    return alpha;
  };
  Alpha const vertex_alpha = alpha_of(*vertices);
  for (std::size_t row = 0; row < vertices->rows; ++row) {
    builder.add_vertex(position[0]->values[row], position[1]->values[row], position[2]->values[row],
                       vertex_alpha.at(row));
    if (has_color)
      builder.add_color(
          cv::Vec3b(uchar(color[0]->values[row]), uchar(color[1]->values[row]), uchar(color[2]->values[row])));
  }
  PlyTextures textures(ply, path, builder);
  if (PlyElement const* const faces = ply.find("face"); faces && faces->rows > 0) {
    PlyProperty const* const lists = find_list(*faces);
    if (!lists) builder.fail("faces without a list 'vertex_indices'");
    std::vector<std::int64_t> const indices = indices_of(*lists, builder);
    Alpha const face_alpha = alpha_of(*faces);
    for (std::size_t row = 0; row < faces->rows; ++row) {
      auto const corners =
          std::span(indices).subspan(lists->offsets[row], lists->offsets[row + 1] - lists->offsets[row]);
      builder.add_polygon(corners, face_alpha.at(row), textures.on_face(row, corners));
    }
  }
  if (PlyElement const* const strips = ply.find("tristrips"); strips && strips->rows > 0) {
    PlyProperty const* const lists = find_list(*strips);
    if (!lists) builder.fail("tristrips without a list 'vertex_indices'");
    std::vector<std::int64_t> const indices = indices_of(*lists, builder);
    constexpr std::int64_t kRestart = -1;
    for (std::size_t row = 0; row < strips->rows; ++row)
      for (auto begin = indices.begin() + std::ptrdiff_t(lists->offsets[row]),
                end = indices.begin() + std::ptrdiff_t(lists->offsets[row + 1]);
           begin != end;) {
        auto const stop = std::find(begin, end, kRestart);
        builder.add_strip({begin, stop}, Light::stops, textures.on_corners({begin, stop}));
        begin = stop == end ? end : stop + 1;
      }
  }
  return builder.take();
}

PlyFile ply_from_mesh(TriangleMesh const& mesh) {
  PlyFile ply;
  PlyElement vertices{"vertex", mesh.vertices.size(), {}};
  constexpr char const* position_names[] = {"x", "y", "z"};
  constexpr char const* color_names[] = {"red", "green", "blue"};
  for (int i = 0; i < 3; ++i) {
    std::vector<double> values;
    for (Eigen::Vector3f const& vertex : mesh.vertices) values.push_back(vertex[i]);
    vertices.properties.push_back(ply_scalar(position_names[i], PlyType::float32, std::move(values)));
  }
  for (int i = 0; i < 3 && !mesh.colors.empty(); ++i) {
    std::vector<double> values;
    for (cv::Vec3b const& color : mesh.colors) values.push_back(color[2 - i]);
    vertices.properties.push_back(ply_scalar(color_names[i], PlyType::uint8, std::move(values)));
  }
  PlyElement faces{"face", mesh.triangles.size(), {}};
  PlyProperty indices;
  indices.name = "vertex_indices";
  indices.type = PlyType::int32;
  indices.is_list = true;
  indices.count_type = PlyType::uint8;
  indices.offsets.push_back(0);
  for (Eigen::Vector3i const& triangle : mesh.triangles) {
    for (int i = 0; i < 3; ++i) indices.values.push_back(triangle[i]);
    indices.offsets.push_back(indices.values.size());
  }
  faces.properties.push_back(std::move(indices));
  ply.elements.push_back(std::move(vertices));
  ply.elements.push_back(std::move(faces));
  return ply;
}

}  // namespace scanview

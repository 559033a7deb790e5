#include "mesh/ply_textures.h"

#include <cmath>

#include "mesh/model_pictures.h"
#include "mesh/words.h"

namespace scanview {
namespace {

Eigen::Vector2f picture_from_ply(double u, double v) { return {float(u), float(1 - v)}; }

std::array<PlyProperty const*, 2> scalars(PlyElement const& element, char const* u, char const* v) {
  std::array<PlyProperty const*, 2> const found = {element.find(u), element.find(v)};
  bool const both = found[0] && found[1] && !found[0]->is_list && !found[1]->is_list;
  return both ? found : std::array<PlyProperty const*, 2>{};
}

}  // namespace

PlyTextures::PlyTextures(PlyFile const& ply, std::filesystem::path const& path, ModelBuilder& builder) {
  ModelPictures pictures(builder);
  for (std::string const& comment : ply.comments) {
    Words words(comment);
    if (words.next() != "TextureFile") continue;
    ModelMaterial material;
    if (cv::Mat3b const picture = pictures.beside(path, trimmed(words.rest())); !picture.empty())
      material.texture = {.picture = picture};
    materials_.push_back(builder.add_material(std::move(material)));
  }
  if (PlyElement const* const vertices = ply.find("vertex"))
    for (auto const& [u, v] : {std::pair{"texture_u", "texture_v"}, {"u", "v"}, {"s", "t"}})
      if (auto const found = scalars(*vertices, u, v); found[0]) of_vertex_ = found;
  if (PlyElement const* const faces = ply.find("face")) {
    of_face_ = faces->find("texcoord");
    if (of_face_ && !of_face_->is_list) of_face_ = nullptr;
    number_ = faces->find("texnumber");
    if (number_ && number_->is_list) number_ = nullptr;
  }
}

PolygonPaint PlyTextures::on_face(std::size_t row, std::span<std::int64_t const> corners) {
  if (materials_.empty() || !of_face_) return on_corners(corners);
  double const number = number_ ? number_->values[row] : 0;
  if (!(number >= 0 && number < double(materials_.size()))) return {};
  at_.clear();
  for (std::uint64_t k = of_face_->offsets[row]; k + 1 < of_face_->offsets[row + 1]; k += 2)
    at_.push_back(picture_from_ply(of_face_->values[k], of_face_->values[k + 1]));
  return {materials_[std::size_t(number)], at_};
}

PolygonPaint PlyTextures::on_corners(std::span<std::int64_t const> corners) {
  if (materials_.empty() || !of_vertex_[0]) return {};
  at_.clear();
  for (std::int64_t const corner : corners) {
    bool const is_there = corner >= 0 && corner < std::int64_t(of_vertex_[0]->values.size());
    at_.push_back(is_there ? picture_from_ply(of_vertex_[0]->values[corner], of_vertex_[1]->values[corner])
                           : Eigen::Vector2f::Constant(NAN));
  }
  return {materials_[0], at_};
}

}  // namespace scanview

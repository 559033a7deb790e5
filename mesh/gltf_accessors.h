#pragma once
#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "base/files.h"

namespace scanview {

/// The numbers behind a glTF file's accessors. Every offset and count is checked against the bytes that are there.
class GltfAccessors {
 public:
  /// `binary` is the second chunk of a GLB file, empty where there is none. Buffers in files of their own are read when
  /// they are first asked for, from the model's folder or below it. Both arguments must outlive this.
  GltfAccessors(Json const& gltf, std::string_view binary, std::filesystem::path const& path)
      : gltf_(gltf), binary_(binary), path_(path) {}

  /// Of type VEC3; integers as KHR_mesh_quantization has them. Throws Error{bad_input}, or an exception of Json's where
  /// a field is missing or of the wrong type.
  std::vector<Eigen::Vector3d> positions(std::size_t accessor);
  /// Of type SCALAR, unsigned.
  std::vector<std::int64_t> indices(std::size_t accessor);
  /// Of type VEC2, floats or normalized integers.
  std::vector<Eigen::Vector2f> texture_coordinates(std::size_t accessor);

  /// The bytes of a buffer view. Throws as positions does.
  std::string_view view_bytes(std::size_t view);
  /// What an URI holds in itself, or the bytes of the file that it names.
  std::string uri_bytes(std::string const& uri) const;

 private:
  std::vector<double> numbers(std::size_t accessor, std::string_view type, std::size_t components);
  std::string_view buffer(std::size_t index);
  std::optional<std::string_view> part_of_buffer(std::size_t view);

  Json const& gltf_;
  std::string_view binary_;
  std::filesystem::path const& path_;
  std::map<std::size_t, std::string> buffers_;
};

/// A count or an index. Negative, broken and huge ones are Error{bad_input, path} with the field's name.
std::size_t gltf_size(Json const& number, char const* name, std::filesystem::path const& path);
/// The one of an object's field, or `otherwise`.
std::size_t gltf_size(Json const& object, char const* key, std::size_t otherwise, std::filesystem::path const& path);

}  // namespace scanview

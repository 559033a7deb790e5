#pragma once
#include <Eigen/Core>
#include <algorithm>
#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "base/files.h"

namespace scanview {

enum ComponentType { kUint32 = 5125, kFloat32 = 5126 };
enum BufferTarget { kVertices = 34962, kIndices = 34963 };

/// Puts together a binary glTF file (Khronos, "glTF 2.0 Specification": §4.4 binary container, §3.6.2 accessors;
/// KHR_materials_unlit).
class GlbWriter {
 public:
  GlbWriter() {
    json_["asset"] = {{"version", "2.0"}, {"generator", "scanview"}};
    json_["extensionsUsed"] = {"KHR_materials_unlit"};
    json_["scene"] = 0;
    json_["scenes"] = Json::array({Json{{"nodes", {0}}}});
    for (char const* key :
         {"nodes", "meshes", "materials", "textures", "images", "samplers", "accessors", "bufferViews"})
      json_[key] = Json::array();
    constexpr int kLinear = 9729, kClampToEdge = 33071;
    json_["samplers"].push_back(
        {{"magFilter", kLinear}, {"minFilter", kLinear}, {"wrapS", kClampToEdge}, {"wrapT", kClampToEdge}});
  }

  /// Column by column, as glTF wants it.
  static Json matrix(Eigen::Matrix4d const& m) {
    Json result = Json::array();
    for (int i = 0; i < 16; ++i) result.push_back(m(i % 4, i / 4));
    return result;
  }

  /// Its index.
  int add(char const* list, Json item) {
    json_[list].push_back(std::move(item));
    return int(json_[list].size()) - 1;
  }
  Json& item(char const* list, int index) { return json_[list][index]; }

  int add_buffer_view(std::string_view bytes) {
    bytes_.resize((bytes_.size() + 3) / 4 * 4, '\0');
    Json const view = {{"buffer", 0}, {"byteOffset", bytes_.size()}, {"byteLength", bytes.size()}};
    bytes_.append(bytes);
    return add("bufferViews", view);
  }

  /// `components` numbers an element, one after the other.
  template <typename Number>
  int add_accessor(std::vector<Number> const& numbers, int components, ComponentType type, BufferTarget target) {
    constexpr char const* names[] = {"", "SCALAR", "VEC2", "VEC3"};
    int const view = add_buffer_view({reinterpret_cast<char const*>(numbers.data()), numbers.size() * sizeof(Number)});
    item("bufferViews", view)["target"] = int(target);
    Json least = Json::array(), greatest = Json::array();
    for (int c = 0; c < components; ++c) {
      Number low = numbers[c], high = numbers[c];
      for (std::size_t i = c; i < numbers.size(); i += components) {
        low = std::min(low, numbers[i]);
        high = std::max(high, numbers[i]);
      }
      least.push_back(low);
      greatest.push_back(high);
    }
    return add("accessors", {{"bufferView", view},
                             {"componentType", int(type)},
                             {"count", numbers.size() / components},
                             {"type", names[components]},
                             {"min", least},
                             {"max", greatest}});
  }

  std::string finish() {
    for (char const* key : {"meshes", "materials", "textures", "images", "samplers", "accessors", "bufferViews"})
      if (json_[key].empty()) json_.erase(key);
    bytes_.resize((bytes_.size() + 3) / 4 * 4, '\0');
    if (!bytes_.empty()) json_["buffers"] = Json::array({Json{{"byteLength", bytes_.size()}}});
    std::string text = json_.dump();
    text.resize((text.size() + 3) / 4 * 4, ' ');
    std::size_t const total = 12 + 8 + text.size() + (bytes_.empty() ? 0 : 8 + bytes_.size());
    if (total > UINT32_MAX) throw std::length_error("a GLB file holds at most 4 GiB");
    std::string glb = "glTF";
    auto const put = [&glb](std::size_t value) {
      for (int i = 0; i < 4; ++i) glb.push_back(char(value >> (8 * i) & 255));
    };
    put(2);
    put(total);
    put(text.size());
    glb += "JSON" + text;
    if (bytes_.empty()) return glb;
    put(bytes_.size());
    glb += std::string("BIN\0", 4) + bytes_;
    return glb;
  }

 private:
  Json json_;
  std::string bytes_;
};

}  // namespace scanview

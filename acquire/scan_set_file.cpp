#include "acquire/scan_set_file.h"

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfIO.h>
#include <ImfInputFile.h>
#include <ImfOutputFile.h>
#include <fmt/format.h>

#include <cmath>
#include <sstream>

#include "base/error.h"
#include "base/image_file.h"
#include "base/parallel.h"

namespace scanview {
namespace fs = std::filesystem;
namespace {

constexpr int kFormat = 1;

/// OpenEXR reads from and writes to memory, so that files appear whole and errors are ours.
class MemoryInput : public Imf::IStream {
 public:
  MemoryInput(std::string const& bytes, std::string const& name) : IStream(name.c_str()), bytes_(bytes) {}
  bool read(char c[], int n) override {
    if (n < 0 || bytes_.size() - at_ < static_cast<std::size_t>(n)) throw std::runtime_error("ends early");
    std::copy_n(bytes_.data() + at_, n, c);
    at_ += static_cast<std::size_t>(n);
    return at_ < bytes_.size();
  }
  std::uint64_t tellg() override { return at_; }
  void seekg(std::uint64_t position) override {
    if (position > bytes_.size()) throw std::runtime_error("ends early");
    at_ = position;
  }

 private:
  std::string const& bytes_;
  std::size_t at_ = 0;
};

class MemoryOutput : public Imf::OStream {
 public:
  MemoryOutput() : OStream("memory") {}
  void write(char const c[], int n) override { stream_.write(c, n); }
  std::uint64_t tellp() override { return static_cast<std::uint64_t>(stream_.tellp()); }
  void seekp(std::uint64_t position) override { stream_.seekp(static_cast<std::streamoff>(position)); }
  std::string bytes() const { return stream_.str(); }

 private:
  std::ostringstream stream_;
};

struct Channel {
  char const* name;
  cv::Mat1f const* values;
};

std::string encode_exr(std::vector<Channel> const& channels) {
  cv::Size const size = channels.front().values->size();
  Imf::Header header(size.width, size.height);
  header.compression() = Imf::ZIPS_COMPRESSION;
  Imf::FrameBuffer buffer;
  for (auto const& channel : channels) {
    header.channels().insert(channel.name, Imf::Channel(Imf::FLOAT));
    auto* base = const_cast<char*>(reinterpret_cast<char const*>(channel.values->ptr()));  // the library only reads
    buffer.insert(channel.name, Imf::Slice(Imf::FLOAT, base, sizeof(float), channel.values->step));
  }
  MemoryOutput memory;
  {
    Imf::OutputFile file(memory, header, 0);
    file.setFrameBuffer(buffer);
    file.writePixels(size.height);
  }
  return memory.bytes();
}

struct WantedChannel {
  char const* name;
  cv::Mat1f* values;
};

void decode_exr(fs::path const& path, std::vector<WantedChannel> const& channels) {
  std::string const bytes = read_file(path);
  try {
    MemoryInput memory(bytes, path.string());
    Imf::InputFile file(memory, 0);
    auto const box = file.header().dataWindow();
    std::int64_t const width = std::int64_t{box.max.x} - box.min.x + 1,
                       height = std::int64_t{box.max.y} - box.min.y + 1;
    // A scan line takes at least a byte of its offset table: a header cannot ask for more rows than the file has bytes.
    if (width < 1 || height < 1 || width > (1 << 15) || height > (1 << 15) ||
        height > static_cast<std::int64_t>(bytes.size()))
      throw Error(ErrorCode::bad_input, path, "has an impossible size");
    Imf::FrameBuffer buffer;
    for (auto const& channel : channels) {
      if (!file.header().channels().findChannel(channel.name))
        throw Error(ErrorCode::bad_input, path, fmt::format("has no channel {}", channel.name));
      channel.values->create(static_cast<int>(height), static_cast<int>(width));
      buffer.insert(channel.name,
                    Imf::Slice::Make(Imf::FLOAT, channel.values->ptr(), box, sizeof(float), channel.values->step));
    }
    file.setFrameBuffer(buffer);
    file.readPixels(box.min.y, box.max.y);
  } catch (Error const&) {
    throw;
  } catch (std::exception const&) {
    throw Error(ErrorCode::bad_input, path, "is damaged or no OpenEXR file");
  }
}

std::string text(Json const& json, char const* key, fs::path const& path) {
  auto const it = json.find(key);
  if (it == json.end() || !it->is_string())
    throw Error(ErrorCode::bad_input, path, fmt::format("has no text '{}'", key));
  return it->get<std::string>();
}

Eigen::Vector3d triple(Json const& json, char const* key, fs::path const& path) {
  auto const it = json.find(key);
  if (it == json.end() || !it->is_array() || it->size() != 3)
    throw Error(ErrorCode::bad_input, path, fmt::format("has no three numbers '{}'", key));
  Eigen::Vector3d v;
  for (int i = 0; i < 3; ++i) {
    if (!(*it)[i].is_number()) throw Error(ErrorCode::bad_input, path, fmt::format("has no three numbers '{}'", key));
    v[i] = (*it)[i].get<double>();
  }
  if (!v.allFinite()) throw Error(ErrorCode::bad_input, path, fmt::format("'{}' is not finite", key));
  return v;
}

Json to_json(Eigen::Vector3d const& v) { return Json::array({v.x(), v.y(), v.z()}); }

Json to_json(ErrorPart const& part) { return {{"rms", json_number(part.rms)}, {"p95", json_number(part.p95)}}; }

ErrorPart error_part(Json const& budget, char const* key, fs::path const& path) {
  ErrorPart part;
  if (!budget.contains(key)) return part;
  auto const value = [&](char const* name) {
    Json const& number = budget[key].value(name, Json(nullptr));
    if (number.is_null()) return std::numeric_limits<double>::quiet_NaN();
    if (!number.is_number() || !(number.get<double>() >= 0))
      throw Error(ErrorCode::bad_input, path, fmt::format("error_budget.{}.{} is no length", key, name));
    return number.get<double>();
  };
  if (!budget[key].is_object())
    throw Error(ErrorCode::bad_input, path, fmt::format("error_budget.{} is no object", key));
  part.rms = value("rms");
  part.p95 = value("p95");
  return part;
}

void require_safe_name(std::string const& name, fs::path const& path) {
  bool safe = !name.empty() && name.size() < 200 && name.front() != '.';
  for (char const c : name)
    safe = safe && (std::isalnum(static_cast<unsigned char>(c)) || c == '_' || c == '-' || c == '.');
  if (!safe)
    throw Error(ErrorCode::bad_input, path,
                fmt::format("view name '{}' is not made of letters, digits, '_', '-', '.'", name));
}

View view_from_json(Json const& json, fs::path const& path) {
  if (!json.is_object()) throw Error(ErrorCode::bad_input, path, "a view is not an object");
  View view;
  view.name = text(json, "name", path);
  require_safe_name(view.name, path);
  if (!json.contains("camera"))
    throw Error(ErrorCode::bad_input, path, fmt::format("view {} has no camera", view.name));
  view.image.camera = Camera::from_json(json["camera"], path);
  if (json.contains("object_from_camera") && !json["object_from_camera"].is_null())
    view.object_from_camera =
        pose_from_json(json["object_from_camera"], path, fmt::format("pose of view {}", view.name));
  if (json.contains("gain")) view.gain = triple(json, "gain", path);
  if (!(view.gain.minCoeff() > 0))
    throw Error(ErrorCode::bad_input, path, fmt::format("gain of view {} is not positive", view.name));
  return view;
}

CameraLight light_from_json(Json const& json, fs::path const& path) {
  CameraLight light;
  auto const refuse = [&] {
    throw Error(ErrorCode::bad_input, path,
                fmt::format("'light' is not {} rows of three finite numbers", CameraLight::kTerms));
  };
  if (!json.is_array() || json.size() != CameraLight::kTerms) refuse();
  for (int k = 0; k < CameraLight::kTerms; ++k) {
    Json const& row = json[static_cast<std::size_t>(k)];
    if (!row.is_array() || row.size() != 3) refuse();
    for (int c = 0; c < 3; ++c) {
      if (!row[static_cast<std::size_t>(c)].is_number()) refuse();
      light.coefficients(k, c) = row[static_cast<std::size_t>(c)].get<double>();
    }
  }
  if (!light.coefficients.allFinite()) refuse();
  return light;
}

void require_size(cv::Mat const& image, Camera const& camera, fs::path const& path) {
  if (image.cols != camera.width() || image.rows != camera.height())
    throw Error(
        ErrorCode::bad_input, path,
        fmt::format("is {}x{}, but its camera is {}x{}", image.cols, image.rows, camera.width(), camera.height()));
}

void read_images(fs::path const& folder, View& view) {
  Camera const& camera = view.image.camera;
  fs::path const in = folder / view_folder(view.name);
  read_range_exr(in / "range.exr", view.image.depth, view.image.sigma);
  require_size(view.image.depth, camera, in / "range.exr");
  view.image.color = read_color(in / "color.png");
  require_size(view.image.color, camera, in / "color.png");
  cv::Mat const mask = read_image(in / "mask.png");
  if (mask.type() != CV_8UC1) throw Error(ErrorCode::bad_input, in / "mask.png", "is not 8-bit gray");
  require_size(mask, camera, in / "mask.png");
  view.image.classes = mask;
  try {
    view.image.check();
  } catch (std::logic_error const&) {
    throw Error(ErrorCode::bad_input, in / "mask.png", "does not agree with range.exr beside it");
  }
}

}  // namespace

fs::path view_folder(std::string const& view_name) { return fs::path("views") / view_name; }

ScanSet read_manifest(fs::path const& given) {
  fs::path const path = fs::is_regular_file(given) ? given : given / "scanset.json";
  if (!fs::exists(path)) throw Error(ErrorCode::bad_input, given, "is not a scan set (it has no scanset.json)");
  Json const json = read_json(path);
  if (!json.is_object() || json.value("format", Json()) != kFormat)
    throw Error(ErrorCode::bad_input, path, fmt::format("is not a scan set of format {}", kFormat));
  ScanSet set;
  set.unit = unit_from_string(text(json, "unit", path), path);
  set.center = triple(json, "center", path);
  if (!json.contains("views") || !json["views"].is_array() || json["views"].empty())
    throw Error(ErrorCode::bad_input, path, "has no views");
  std::set<std::string> names;
  for (auto const& view : json["views"]) {
    set.views.push_back(view_from_json(view, path));
    if (!names.insert(set.views.back().name).second)
      throw Error(ErrorCode::bad_input, path, fmt::format("names view {} twice", set.views.back().name));
  }
  Json const budget = json.value("error_budget", Json::object());
  if (!budget.is_object()) throw Error(ErrorCode::bad_input, path, "error_budget is no object");
  set.error_budget = {error_part(budget, "sampling", path), error_part(budget, "registration", path),
                      error_part(budget, "approximation", path)};
  if (json.contains("light")) set.light = light_from_json(json["light"], path);
  return set;
}

void write_manifest(fs::path const& folder, ScanSet const& set) {
  Json views = Json::array();
  for (auto const& view : set.views)
    views.push_back(
        {{"name", view.name},
         {"camera", view.image.camera.to_json()},
         {"object_from_camera", view.object_from_camera ? pose_to_json(*view.object_from_camera) : Json(nullptr)},
         {"color", (view_folder(view.name) / "color.png").generic_string()},
         {"range", (view_folder(view.name) / "range.exr").generic_string()},
         {"gain", to_json(view.gain)}});
  Json manifest = {{"format", kFormat},
                   {"unit", to_string(set.unit)},
                   {"center", to_json(set.center)},
                   {"views", std::move(views)},
                   {"error_budget",
                    {{"sampling", to_json(set.error_budget.sampling)},
                     {"registration", to_json(set.error_budget.registration)},
                     {"approximation", to_json(set.error_budget.approximation)}}}};
  if (set.light) {
    manifest["light"] = Json::array();
    for (int k = 0; k < CameraLight::kTerms; ++k) {
      manifest["light"].push_back(to_json(Eigen::Vector3d(set.light->coefficients.row(k).transpose())));
    }
  }
  write_json(folder / "scanset.json", manifest);
}

ScanSet read_scan_set(fs::path const& folder, Context& context) {
  ScanSet set = read_manifest(folder);
  for_each_index(context, set.views.size(), [&](std::size_t i) { read_images(folder, set.views[i]); });
  return set;
}

void write_scan_set(fs::path const& folder, ScanSet const& set, Context& context) {
  for_each_index(context, set.views.size(), [&](std::size_t i) {
    View const& view = set.views[i];
    view.image.check();
    fs::path const out = folder / view_folder(view.name);
    std::error_code error;
    fs::create_directories(out, error);
    if (error) throw Error(ErrorCode::io, out, "cannot create: " + error.message());
    write_file(out / "color.png", encode_png(view.image.color));
    write_range_exr(out / "range.exr", view.image.depth, view.image.sigma);
    write_file(out / "mask.png", encode_png(view.image.classes));
  });
  write_manifest(folder, set);
}

std::vector<fs::path> image_files(ScanSet const& set) {
  std::vector<fs::path> files;
  for (auto const& view : set.views)
    for (char const* name : {"color.png", "range.exr", "mask.png"}) files.push_back(view_folder(view.name) / name);
  return files;
}

void write_range_exr(fs::path const& path, cv::Mat1f const& depth, cv::Mat1f const& sigma) {
  write_file(path, encode_exr({{"S", &sigma}, {"Z", &depth}}));
}

void write_depth_exr(fs::path const& path, cv::Mat1f const& depth) { write_file(path, encode_exr({{"Z", &depth}})); }

void read_range_exr(fs::path const& path, cv::Mat1f& depth, cv::Mat1f& sigma) {
  decode_exr(path, {{"S", &sigma}, {"Z", &depth}});
}

cv::Mat1f read_depth_exr(fs::path const& path) {
  cv::Mat1f depth;
  decode_exr(path, {{"Z", &depth}});
  return depth;
}

}  // namespace scanview

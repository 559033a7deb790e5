#include "cli/frame_cameras.h"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <cstdio>

#include "base/animated_png.h"
#include "base/error.h"
#include "base/files.h"
#include "base/image_file.h"

namespace scanview {

void add_camera_options(CLI::App* verb, FrameCameras& cameras) {
  CLI::Option_group* which = verb->add_option_group("cameras");
  which->add_option("--orbit", cameras.orbit, "A full turn in so many pictures")->check(CLI::Range(1, 100000));
  which->add_flag("--halfway", cameras.halfway, "From halfway between consecutive views");
  which->add_option("--path", cameras.path, "Cameras of a path file");
  which->add_option("--like", cameras.like, "From the camera of this view");
  which->require_option(1);
  verb->add_option("--size", cameras.size, "WIDTHxHEIGHT");
}

std::pair<int, int> parse_picture_size(std::string const& text) {
  int width = 0, height = 0;
  char end = 0;
  if (std::sscanf(text.c_str(), "%dx%d%c", &width, &height, &end) != 2 || width < 1 || height < 1 || width > 16384 ||
      height > 16384)
    throw Error(ErrorCode::usage, {}, fmt::format("--size {}: expected WIDTHxHEIGHT, 1 to 16384 each", text));
  return {width, height};
}

std::vector<PathCamera> frame_cameras(FrameCameras const& cameras, ScanSet const& set, double radius) {
  auto const [width, height] = parse_picture_size(cameras.size);
  OrbitFrame const frame = orbit_frame(set, radius);
  if (cameras.orbit > 0) return orbit_path(set, frame, cameras.orbit, width, height);
  if (cameras.halfway) return halfway_path(set, frame, width, height);
  if (!cameras.path.empty()) return read_camera_path(cameras.path, set, frame, width, height);
  return {camera_like(set, cameras.like, width, height)};
}

FrameFolder::FrameFolder(std::filesystem::path folder, Film film, int milliseconds)
    : folder_(std::move(folder)), film_(film), milliseconds_(milliseconds) {
  std::error_code error;
  std::filesystem::create_directories(folder_, error);
  if (error) throw Error(ErrorCode::io, folder_, "cannot create: " + error.message());
}

std::string FrameFolder::write(std::string const& name, cv::Mat4b const& picture) {
  std::string file = name + ".png", png = encode_png(picture);
  write_file(folder_ / file, png);
  if (film_ == Film::film) pictures_.push_back(std::move(png));
  return file;
}

void FrameFolder::finish() {
  if (film_ == Film::film) write_file(folder_ / "film.png", animated_png(pictures_, milliseconds_));
}

}  // namespace scanview

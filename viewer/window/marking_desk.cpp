#include "viewer/window/marking_desk.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "acquire/scan_set_file.h"
#include "base/error.h"
#include "base/image_file.h"

namespace scanview {
namespace fs = std::filesystem;
namespace {

Eigen::Vector3f color_of(OutlineKind kind) {
  switch (kind) {
    case OutlineKind::keep:
      return {0.3F, 0.9F, 0.4F};
    case OutlineKind::remove:
      return {1.0F, 0.35F, 0.3F};
    default:
      return {1.0F, 0.85F, 0.2F};
  }
}

bool has_depth(cv::Mat1b const& classes, int x, int y) {
  return classes(y, x) == static_cast<std::uint8_t>(PixelClass::object);
}

std::string joined(std::vector<std::string> const& names) {
  std::string text;
  constexpr std::size_t kMost = 8;
  for (std::size_t i = 0; i < std::min(names.size(), kMost); ++i) text += (i == 0 ? "" : ", ") + names[i];
  return names.size() > kMost ? text + ", ..." : text;
}

}  // namespace

MarkingDesk::MarkingDesk(std::shared_ptr<ViewLibrary> library, fs::path folder)
    : library_(std::move(library)), folder_(std::move(folder)) {}

void MarkingDesk::use(std::shared_ptr<ViewLibrary> library) {
  std::string const old = name();
  library_ = std::move(library);
  auto const& views = library_->set().views;
  auto const same = std::find_if(views.begin(), views.end(), [&](View const& view) { return view.name == old; });
  PictureSheet const sheet = sheet_;
  show(same == views.end() ? 0 : static_cast<std::size_t>(same - views.begin()));
  fitted_ = same != views.end();
  if (fitted_) sheet_ = sheet;
}

fs::path MarkingDesk::file() const {
  if (folder_.empty()) return {};
  return folder_ / (mode_ == WindowMode::mark ? "marks.json" : "mesh_marks.json");
}

void MarkingDesk::enter(WindowMode mode) {
  WindowMode const before = mode_;
  mode_ = mode;
  try {
    bool const there = !folder_.empty() && fs::exists(file());
    if (there && mode == WindowMode::mark) marks_ = RegistrationMarks::from_json(read_json(file()), file());
    if (there && mode == WindowMode::outline && outlines_.open(name()).empty())
      outlines_ = OutlineMarks::from_json(read_json(file()), file());
  } catch (Error const&) {
    mode_ = before;
    throw;
  }
  if (picture_.empty()) show(view_);
  number_ = marks_.next_number(name());
}

bool MarkingDesk::show(std::size_t view) {
  if (view >= library_->set().views.size()) return false;
  view_ = view;
  fitted_ = false;
  unreadable_.clear();
  RangeImage const& image = library_->set().views[view].image;
  try {
    cv::Size const size(image.camera.width(), image.camera.height());
    if (folder_.empty()) {
      picture_ = image.color.clone();
      classes_ = image.classes;
    } else {
      fs::path const in = folder_ / view_folder(name());
      picture_ = read_color(in / "color.png");
      classes_ = read_gray(in / "mask.png");
    }
    if (picture_.size() != size || classes_.size() != size)
      throw Error(ErrorCode::bad_input, {}, "picture or mask does not have its camera's size");
    for (int y = 0; y < picture_.rows; ++y) {
      for (int x = 0; x < picture_.cols; ++x) {
        if (!has_depth(classes_, x, y)) picture_(y, x) /= 3;
      }
    }
  } catch (Error const& error) {
    picture_ = cv::Mat3b();
    classes_ = cv::Mat1b();
    unreadable_ = error.what();
  }
  number_ = marks_.next_number(name());
  return true;
}

void MarkingDesk::step(int views) {
  int const count = static_cast<int>(library_->set().views.size());
  show(static_cast<std::size_t>(((static_cast<int>(view_) + views) % count + count) % count));
}

std::string MarkingDesk::click(double x, double y) {
  Camera const& camera = library_->set().views[view_].image.camera;
  Eigen::Vector2d pixel = sheet_.to_picture(x, y);
  if (picture_.empty()) return unreadable_;
  if (mode_ == WindowMode::outline) {
    pixel.x() = std::clamp(pixel.x(), -0.5, camera.width() - 0.5);
    pixel.y() = std::clamp(pixel.y(), -0.5, camera.height() - 0.5);
    outlines_.add_corner(name(), pixel);
    return {};
  }
  // As it will be written, so that register judges the pixel that is judged here.
  pixel = {std::round(100 * pixel.x()) / 100, std::round(100 * pixel.y()) / 100};
  long const column = std::lround(pixel.x()), row = std::lround(pixel.y());
  if (!camera.contains(pixel) || column < 0 || row < 0 || column >= camera.width() || row >= camera.height())
    return "that is beside the picture";
  if (!has_depth(classes_, static_cast<int>(column), static_cast<int>(row)))
    return "no depth there: points go where the picture is bright";
  marks_.set(name(), std::to_string(number_), pixel);
  // Onwards: a point below that was passed over is not seen in this view.
  while (marks_.has(name(), std::to_string(number_))) ++number_;
  return save();
}

std::string MarkingDesk::obey(Command command) {
  bool const marking = mode_ == WindowMode::mark;
  switch (command) {
    case Command::previous_view:
      step(-1);
      return {};
    case Command::next_view:
      step(1);
      return {};
    case Command::next_point:
      ++number_;
      return {};
    case Command::previous_point:
      number_ = std::max(1, number_ - 1);
      return {};
    case Command::reset:
      fitted_ = false;
      return {};
    case Command::remove_last: {
      bool const only_corner = !marking && !outlines_.open(name()).empty();
      if (!(marking ? marks_.remove_last(name()) : outlines_.remove_last(name()))) return "nothing left in this view";
      if (marking) number_ = marks_.next_number(name());
      return only_corner ? std::string() : save();
    }
    case Command::close_outline: {
      std::string const why = outlines_.close(kind);
      return why.empty() ? save() : why;
    }
    default:
      return {};
  }
}

std::string MarkingDesk::save() const {
  if (folder_.empty()) return {};
  try {
    bool const nothing = mode_ == WindowMode::mark ? marks_.empty() : outlines_.empty();
    if (nothing && !fs::exists(file())) return {};
    write_json(file(), mode_ == WindowMode::mark ? marks_.to_json() : outlines_.to_json());
    return {};
  } catch (Error const& error) {
    return std::string("not saved: ") + error.what();
  }
}

cv::Mat4b MarkingDesk::draw(int width, int height) {
  Camera const& camera = library_->set().views[view_].image.camera;
  if (fitted_) {
    sheet_.resize({width, height});
  } else {
    sheet_ = PictureSheet({camera.width(), camera.height()}, {width, height});
    fitted_ = true;
  }
  return sheet_.draw(picture_);
}

Overlay MarkingDesk::overlay() const {
  Overlay overlay;
  auto const line = [&](MeshMarks::Polygon const& corners, Eigen::Vector3f const& color, bool closed) {
    Overlay::Line result{{}, color, closed};
    for (auto const& corner : corners) result.points.push_back(sheet_.to_window(corner));
    overlay.lines.push_back(std::move(result));
  };
  if (mode_ == WindowMode::mark) {
    for (auto const& mark : marks_.of(name()))
      overlay.dots.push_back({sheet_.to_window(mark.pixel), {1.0F, 0.85F, 0.2F}, mark.name});
    return overlay;
  }
  for (auto const& outline : outlines_.of(name()))
    line(outline.corners, color_of(outline.kind), outline.kind != OutlineKind::cut);
  auto const open = outlines_.open(name());
  line(open, {1, 1, 1}, false);
  for (auto const& corner : open) overlay.dots.push_back({sheet_.to_window(corner), {1, 1, 1}, ""});
  return overlay;
}

std::vector<std::string> MarkingDesk::text() const {
  std::vector<std::string> lines = {fmt::format("view {} ({} of {})", name(), view_ + 1, library_->set().views.size())};
  if (!unreadable_.empty()) lines.push_back(unreadable_);
  if (mode_ == WindowMode::mark) {
    lines.push_back(fmt::format("the next click is point {}", number_));
    lines.push_back(fmt::format("{} points in this view", marks_.of(name()).size()));
    std::vector<std::string> names;
    for (auto const& view : library_->set().views) names.push_back(view.name);
    auto const unplaced = marks_.unplaced(names);
    lines.push_back(unplaced.empty() ? "enough points to place every view"
                                     : "not yet three shared points: " + joined(unplaced));
  } else {
    lines.push_back(
        fmt::format("{} outlines, {} corners of the next", outlines_.of(name()).size(), outlines_.open(name()).size()));
  }
  if (folder_.empty()) {
    lines.emplace_back("the set has no folder: nothing is kept");
  } else {
    bool const marking = mode_ == WindowMode::mark;
    lines.push_back(fmt::format("scanview {0} {1} {2} {3}", marking ? "register" : "mesh", folder_.string(),
                                marking ? "--init" : "--marks", file().string()));
  }
  return lines;
}

}  // namespace scanview

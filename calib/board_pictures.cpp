#include "calib/board_pictures.h"

#include <fmt/format.h>
#include <glob.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <map>
#include <optional>
#include <set>

#include "base/error.h"
#include "base/image_file.h"
#include "base/parallel.h"

namespace scanview {
namespace {

namespace fs = std::filesystem;
using Layout = BoardDescription::Layout;

bool is_picture(fs::path const& path) {
  static std::set<std::string> const endings = {".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp", ".pgm", ".ppm"};
  std::string ending = path.extension().string();
  std::transform(ending.begin(), ending.end(), ending.begin(), [](unsigned char c) { return std::tolower(c); });
  return endings.contains(ending) && fs::is_regular_file(path);
}

std::vector<fs::path> expand(std::string const& pattern) {
  std::vector<fs::path> found;
  if (fs::is_directory(pattern)) {
    for (auto const& entry : fs::directory_iterator(pattern))
      if (is_picture(entry.path())) found.push_back(entry.path());
    return found;
  }
  if (fs::exists(pattern)) return {pattern};
  ::glob_t matches = {};
  if (::glob(pattern.c_str(), 0, nullptr, &matches) == 0)
    for (std::size_t i = 0; i < matches.gl_pathc; ++i) found.emplace_back(matches.gl_pathv[i]);
  ::globfree(&matches);
  return found;
}

// The last run of digits in a file's name.
std::optional<long> number_of(fs::path const& path) {
  std::string const stem = path.stem().string();
  std::size_t end = stem.size();
  while (end > 0 && !std::isdigit(static_cast<unsigned char>(stem[end - 1]))) --end;
  std::size_t begin = end;
  while (begin > 0 && end - begin < 15 && std::isdigit(static_cast<unsigned char>(stem[begin - 1]))) --begin;
  if (begin == end) return std::nullopt;
  return std::stol(stem.substr(begin, end - begin));
}

using Numbered = std::map<long, fs::path>;

// Empty where one has no number, or two share one.
std::optional<Numbered> by_number(std::vector<fs::path> const& paths) {
  Numbered result;
  for (fs::path const& path : paths) {
    auto const number = number_of(path);
    if (!number || !result.emplace(*number, path).second) return std::nullopt;
  }
  return result;
}

struct Detected {
  cv::Size size;
  DetectedBoard board;
};

// The size that pictures with a board share; one that differs is named.
cv::Size common_size(std::vector<fs::path> const& paths, std::vector<Detected> const& detected) {
  std::map<std::pair<int, int>, std::size_t> votes;
  for (Detected const& d : detected)
    if (d.board.found()) ++votes[{d.size.width, d.size.height}];
  if (votes.empty()) return {};
  auto const most =
      std::max_element(votes.begin(), votes.end(), [](auto const& a, auto const& b) { return a.second < b.second; });
  cv::Size const size(most->first.first, most->first.second);
  for (std::size_t i = 0; i < paths.size(); ++i)
    if (detected[i].board.found() && detected[i].size != size)
      throw Error(ErrorCode::bad_input, paths[i],
                  fmt::format("has {} x {} pixels, the others of its camera {} x {}", detected[i].size.width,
                              detected[i].size.height, size.width, size.height));
  return size;
}

}  // namespace

std::vector<fs::path> find_pictures(std::vector<std::string> const& patterns) {
  std::vector<fs::path> all;
  for (std::string const& pattern : patterns) {
    auto found = expand(pattern);
    if (found.empty()) throw Error(ErrorCode::bad_input, pattern, "no picture there");
    all.insert(all.end(), found.begin(), found.end());
  }
  std::sort(all.begin(), all.end());
  all.erase(std::unique(all.begin(), all.end()), all.end());
  return all;
}

PicturePairs pair_pictures(std::vector<fs::path> const& given_left, std::vector<fs::path> const& given_right) {
  PicturePairs result;
  std::vector<fs::path> left = given_left, right = given_right;
  if (right.empty()) {
    for (fs::path const& path : left) result.pairs.push_back({path.filename().string(), path, {}});
    return result;
  }
  // A pattern as left*.jpg also catches left.jpg: beside numbered files, one without a number belongs to no pair.
  for (auto* const paths : {&left, &right}) {
    auto const numbered = static_cast<std::size_t>(
        std::count_if(paths->begin(), paths->end(), [](fs::path const& p) { return number_of(p).has_value(); }));
    if (numbered < 3) continue;
    std::erase_if(*paths, [&](fs::path const& p) {
      if (number_of(p)) return false;
      result.unpaired.push_back(fmt::format("{} has no number in its name: left out", p.filename().string()));
      return true;
    });
  }
  auto const lefts = by_number(left), rights = by_number(right);
  if (lefts && rights) {
    std::set<long> numbers;
    for (auto const* const side : {&*lefts, &*rights})
      for (auto const& [number, path] : *side) numbers.insert(number);
    for (long const number : numbers) {
      auto const l = lefts->find(number);
      auto const r = rights->find(number);
      PicturePair pair;
      if (l != lefts->end()) pair.left = l->second;
      if (r != rights->end()) pair.right = r->second;
      pair.name = (pair.left.empty() ? pair.right : pair.left).filename().string();
      if (pair.left.empty() || pair.right.empty())
        result.unpaired.push_back(fmt::format("{} has no {} partner: it helps its own camera only", pair.name,
                                              pair.left.empty() ? "left" : "right"));
      result.pairs.push_back(std::move(pair));
    }
    return result;
  }
  if (left.size() != right.size())
    throw Error(ErrorCode::usage, {},
                fmt::format("{} left and {} right pictures, and their names hold no numbers to pair them by",
                            left.size(), right.size()));
  for (std::size_t i = 0; i < left.size(); ++i)
    result.pairs.push_back({left[i].filename().string(), left[i], right[i]});
  return result;
}

BoardPictures detect_boards(std::vector<PicturePair> const& pairs, BoardDescription const& board, Context& context) {
  board.validate();
  std::vector<fs::path> paths[2];
  for (PicturePair const& pair : pairs) {
    paths[0].push_back(pair.left);
    paths[1].push_back(pair.right);
  }
  std::size_t const count = pairs.size();
  std::vector<Detected> detected[2] = {std::vector<Detected>(count), std::vector<Detected>(count)};
  auto const detect = [&](BoardDescription const& description, std::size_t i) {
    fs::path const& path = paths[i / count][i % count];
    if (path.empty()) return;
    cv::Mat const picture = read_image(path);
    detected[i / count][i % count] = {picture.size(), detect_board(picture, description)};
  };
  for_each_index(
      context, 2 * count, [&](std::size_t i) { detect(board, i); }, "boards");

  BoardPictures result;
  result.board = board;
  if (board.kind == BoardDescription::Kind::charuco && board.layout == Layout::automatic) {
    // A part of a board may fit both layouts; all pictures together do not.
    int old_markers = 0, current_markers = 0;
    for (auto const& side : detected)
      for (Detected const& d : side) {
        old_markers += d.board.old_markers;
        current_markers += d.board.current_markers;
      }
    result.board.layout = old_markers > current_markers ? Layout::old : Layout::current;
    for_each_index(context, 2 * count, [&](std::size_t i) {
      DetectedBoard const& d = detected[i / count][i % count].board;
      if (d.found() && d.layout != result.board.layout) detect(result.board, i);
    });
  }
  result.left_size = common_size(paths[0], detected[0]);
  result.right_size = common_size(paths[1], detected[1]);
  for (std::size_t i = 0; i < count; ++i) {
    result.views.push_back(
        {pairs[i].name, std::move(detected[0][i].board.corners), std::move(detected[1][i].board.corners)});
    for (std::size_t side = 0; side < 2; ++side)
      if (!paths[side][i].empty() && !detected[side][i].board.why.empty())
        (side == 0 ? result.left_why : result.right_why)
            .push_back({paths[side][i].filename().string(), detected[side][i].board.why});
  }
  return result;
}

}  // namespace scanview

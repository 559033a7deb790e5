#include "mesh/outline.h"

#include <algorithm>
#include <climits>
#include <cmath>
#include <map>
#include <utility>

namespace scanview {
namespace {

double cross(Eigen::Vector2d const& a, Eigen::Vector2d const& b) { return a.x() * b.y() - a.y() * b.x(); }

/// The graph whose vertices are the corners of pixels, (i, j) at (i − ½, j − ½), and whose edges ("cracks") are the
/// sides between pixels that are not on one surface.
class CrackGraph {
 public:
  explicit CrackGraph(SurfaceLinks const& links)
      : links_(links),
        width_(links.object.cols),
        height_(links.object.rows),
        horizontal_(cv::Mat1b::zeros(height_ + 1, width_ + 1)),
        vertical_(cv::Mat1b::zeros(height_ + 1, width_ + 1)) {
    for (int j = 0; j <= height_; ++j)
      for (int i = 0; i <= width_; ++i) {
        if (i < width_) horizontal_(j, i) = parts({i, j - 1}, {i, j});
        if (j < height_) vertical_(j, i) = parts({i - 1, j}, {i, j});
      }
  }

  int width() const { return width_; }
  int height() const { return height_; }

  /// Directions 0..3: +x, +y, −x, −y.
  static Eigen::Vector2i step(int direction) {
    static Eigen::Vector2i const steps[4] = {{1, 0}, {0, 1}, {-1, 0}, {0, -1}};
    return steps[direction];
  }
  bool has(Eigen::Vector2i corner, int direction) const {
    uchar const* const at = crack(corner, direction);
    return at && *at;
  }
  void erase(Eigen::Vector2i corner, int direction) { *const_cast<uchar*>(crack(corner, direction)) = 0; }
  int degree(Eigen::Vector2i corner) const {
    int const i = corner.x(), j = corner.y();
    return horizontal_(j, i) + vertical_(j, i) + (i > 0 ? horizontal_(j, i - 1) : 0) +
           (j > 0 ? vertical_(j - 1, i) : 0);
  }
  /// Whether cracks meet here, or the picture's frame turns or is left: it is to be followed exactly, for what another
  /// picture shows may begin there.
  bool is_node(Eigen::Vector2i corner) const {
    int const count = degree(corner);
    bool const across = corner.x() == 0 || corner.x() == width_, down = corner.y() == 0 || corner.y() == height_;
    if (count != 2 || !(across || down)) return count != 2;
    bool const along_x = has(corner, 0) && has(corner, 2), along_y = has(corner, 1) && has(corner, 3);
    return !(down && along_x) && !(across && along_y);
  }
  /// The pixels beside the crack that leads from `corner` in `direction`.
  static Gate gate(Eigen::Vector2i corner, int direction) {
    int const i = corner.x(), j = corner.y();
    switch (direction) {
      case 0:
        return {{i, j}, {i, j - 1}};
      case 1:
        return {{i - 1, j}, {i, j}};
      case 2:
        return {{i - 1, j - 1}, {i - 1, j}};
      default:
        return {{i, j - 1}, {i - 1, j - 1}};
    }
  }

 private:
  bool parts(Eigen::Vector2i a, Eigen::Vector2i b) const {
    bool const in_a = links_.is_object(a.x(), a.y()), in_b = links_.is_object(b.x(), b.y());
    return in_a != in_b || (in_a && !links_.linked(a.x(), a.y(), b.x(), b.y()));
  }
  uchar const* crack(Eigen::Vector2i corner, int direction) const {
    int const i = corner.x() - (direction == 2), j = corner.y() - (direction == 3);
    if (i < 0 || j < 0) return nullptr;
    return direction % 2 == 0 ? &horizontal_(j, i) : &vertical_(j, i);
  }

  SurfaceLinks const& links_;
  int width_, height_;
  cv::Mat1b horizontal_, vertical_;
};

/// Cracks from node to node (CrackGraph::is_node), or all around.
struct Chain {
  std::vector<Eigen::Vector2i> corners;  ///< one more than gates
  std::vector<Gate> gates;
  bool closed() const { return corners.front() == corners.back(); }
};

Chain follow(CrackGraph& graph, cv::Mat1b const& is_node, Eigen::Vector2i corner, int direction) {
  Chain chain;
  chain.corners.push_back(corner);
  while (true) {
    chain.gates.push_back(CrackGraph::gate(corner, direction));
    graph.erase(corner, direction);
    corner += CrackGraph::step(direction);
    chain.corners.push_back(corner);
    if (is_node(corner.y(), corner.x())) return chain;
    int next = 0;
    while (next < 4 && !graph.has(corner, next)) ++next;
    if (next == 4) return chain;  // back where a loop began
    direction = next;
  }
}

/// Takes the graph apart, whose copies share their cracks.
std::vector<Chain> find_chains(CrackGraph graph) {
  cv::Mat1b is_node(graph.height() + 1, graph.width() + 1);
  std::vector<Eigen::Vector2i> corners;  // where cracks meet
  for (int j = 0; j <= graph.height(); ++j)
    for (int i = 0; i <= graph.width(); ++i) {
      is_node(j, i) = graph.is_node({i, j});
      if (graph.degree({i, j}) > 0) corners.emplace_back(i, j);
    }
  std::vector<Chain> chains;
  for (int nodes_first = 1; nodes_first >= 0; --nodes_first)
    for (Eigen::Vector2i const& corner : corners)
      for (int direction = 0; direction < 4; ++direction)
        if (is_node(corner.y(), corner.x()) == nodes_first && graph.has(corner, direction))
          chains.push_back(follow(graph, is_node, corner, direction));
  return chains;
}

/// How near to a pixel's centre, in parts of the distance to its neighbour, a segment may pass: far enough for single
/// precision to keep the centre on its side, near enough to keep straight borders in one piece.
constexpr double kMargin = 0.01;

/// Where a segment may end: at the corner before gate `gate`, or on that gate, so many eighths from left to right.
struct ChainPlace {
  int gate = 0;
  int eighths = 0;  ///< 0: the corner

  bool operator==(ChainPlace const&) const = default;
};

class ChainSimplifier {
 public:
  /// between_nodes: its ends stay. free_loop: closed without a node on it, so it may begin anywhere. slit: open, and
  /// nothing else meets either end.
  enum class Kind { between_nodes, free_loop, slit };
  ChainSimplifier(Chain const& chain, Kind kind) : chain_(chain), count_(int(chain.gates.size())), kind_(kind) {}

  /// The polyline's vertices, the first and the last included; gates go on counting after a closed chain's end.
  std::vector<ChainPlace> run() const {
    std::vector<ChainPlace> best = from({0, 0});
    // At a slit's ends both its sides have one vertex: without another between them nothing would part the sides.
    if (kind_ == Kind::slit && best.size() == 2) best.insert(best.begin() + 1, between(best[0], best[1]));
    if (kind_ != Kind::free_loop) return best;
    std::vector<ChainPlace> const other = from(best[1]);
    return other.size() < best.size() ? other : best;
  }

  Eigen::Vector2d position(ChainPlace const& place) const {
    if (place.eighths > 0) {
      Gate const& on = gate(place.gate);
      return on.left.cast<double>() + place.eighths / 8.0 * (on.right - on.left).cast<double>();
    }
    int const corner = place.gate <= count_ ? place.gate : place.gate - count_;
    return chain_.corners[corner].cast<double>() - Eigen::Vector2d(0.5, 0.5);
  }
  Gate const& gate(int index) const { return chain_.gates[index % count_]; }

  /// The gates that a segment passes, those its ends lie on included: the first, and the one after the last.
  static std::pair<int, int> passed(ChainPlace const& from, ChainPlace const& to) {
    return {from.gate, to.eighths > 0 ? to.gate + 1 : to.gate};
  }

 private:
  std::vector<ChainPlace> from(ChainPlace const& start) const {
    std::vector<ChainPlace> result = {start};
    ChainPlace const end{start.gate + count_, start.eighths};
    while (result.back() != end) {
      // Of the places that are as far as can be, the one from which the next piece gets farthest.
      ChainPlace best;
      int best_reach = -1;
      for (ChainPlace const& place : farthest(result.back(), end)) {
        int const reach = place == end ? INT_MAX : order(farthest(place, end).front());
        if (reach > best_reach) best = place;
        best_reach = std::max(best_reach, reach);
      }
      result.push_back(best);
    }
    settle(result);
    return result;
  }

  /// Grows along the chain.
  static int order(ChainPlace const& place) { return 2 * place.gate + (place.eighths > 0); }

  /// The places on the last gate, or the last corner, up to `end` that a straight line reaches through all gates
  /// between.
  std::vector<ChainPlace> farthest(ChainPlace const& start, ChainPlace const& end) const {
    Eigen::Vector2d const origin = position(start);
    Eigen::Vector2d left, right;  // of the cone of lines that pass all gates so far
    bool open = true;
    std::vector<ChainPlace> reached;
    auto const try_place = [&](ChainPlace const& place) {
      Eigen::Vector2d const v = position(place) - origin;
      if (!open && !(cross(right, v) >= 0 && cross(v, left) >= 0)) return;
      if (!reached.empty() && order(reached.front()) != order(place)) reached.clear();
      reached.push_back(place);
    };
    for (int index = start.eighths > 0 ? start.gate + 1 : start.gate;; ++index) {
      if (index > start.gate) try_place({index, 0});
      if (index == end.gate) {
        if (end.eighths > 0) try_place(end);
        return reached;
      }
      for (int const eighths : {4, 3, 5, 2, 6, 1, 7}) try_place({index, eighths});
      Eigen::Vector2d const l = gate(index).left.cast<double>(), r = gate(index).right.cast<double>();
      Eigen::Vector2d const to_left = l + kMargin * (r - l) - origin, to_right = r + kMargin * (l - r) - origin;
      if (open) {
        left = to_left;
        right = to_right;
        open = false;
      } else {
        if (cross(left, to_right) > 0 || cross(to_left, right) > 0) return reached;
        if (cross(to_left, left) > 0) left = to_left;
        if (cross(right, to_right) > 0) right = to_right;
      }
      if (cross(right, left) <= 0) return reached;
    }
  }

  /// The place near the middle of a straight piece that bends it least.
  ChainPlace between(ChainPlace const& from, ChainPlace const& to) const {
    int const middle = (from.gate + to.gate) / 2;
    ChainPlace best{middle, 4};
    double least = INFINITY;
    for (int eighths = 1; eighths < 8; ++eighths) {
      ChainPlace const place{middle, eighths};
      double const sum = deviation(from, place) + deviation(place, to);
      if (sum >= least) continue;
      least = sum;
      best = place;
    }
    return best;
  }

  /// How far a straight line is from the middles of the gates it passes, squared and summed; infinite where it fails
  /// one.
  double deviation(ChainPlace const& from, ChainPlace const& to) const {
    Eigen::Vector2d const origin = position(from), along = position(to) - origin;
    double sum = 0;
    auto const [first, end] = passed(from, to);
    for (int index = first; index < end; ++index) {
      Eigen::Vector2d const left = gate(index).left.cast<double>();
      double const turn = cross(along, gate(index).right.cast<double>() - left);
      if (!(turn < 0)) return INFINITY;
      double const at = -cross(along, left - origin) / turn;
      if (!(at >= kMargin && at <= 1 - kMargin)) return INFINITY;
      sum += (at - 0.5) * (at - 0.5);
    }
    return sum;
  }

  /// The fewest vertices are not yet the best: each slides to where its two pieces follow the border best.
  void settle(std::vector<ChainPlace>& places) const {
    constexpr int kSweeps = 2, kReach = 2;
    for (int sweep = 0; sweep < kSweeps; ++sweep)
      for (std::size_t k = 1; k + 1 < places.size(); ++k) {
        ChainPlace const before = places[k - 1], after = places[k + 1], old = places[k];
        double least = deviation(before, old) + deviation(old, after);
        for (int gate = old.gate - kReach; gate <= old.gate + kReach; ++gate)
          for (int eighths = 0; eighths < 8; ++eighths) {
            ChainPlace const place{gate, eighths};
            if (order(place) <= order(before) || order(place) >= order(after)) continue;
            double const sum = deviation(before, place) + deviation(place, after);
            if (sum >= least) continue;
            least = sum;
            places[k] = place;
          }
      }
  }

  Chain const& chain_;
  int count_;
  Kind kind_;
};

}  // namespace

Outline trace_outline(SurfaceLinks const& links) {
  Outline outline;
  CrackGraph const graph(links);
  std::map<std::pair<int, int>, int> vertex_of_place;  // in eighths of a pixel
  auto vertex = [&](Eigen::Vector2d const& position) {
    int const x8 = int(8 * position.x()), y8 = int(8 * position.y());
    auto [it, is_new] = vertex_of_place.try_emplace({y8, x8}, int(outline.vertices.size()));
    if (is_new) {
      OutlineVertex added{position, {}};
      // The columns and rows beside it: the same one where a coordinate is whole.
      for (int y : {y8 >> 3, (y8 + 7) >> 3})
        for (int x : {x8 >> 3, (x8 + 7) >> 3}) {
          Eigen::Vector2i const pixel(x, y);
          bool const inside = x >= 0 && y >= 0 && x < links.object.cols && y < links.object.rows;
          if (inside && std::find(added.pixels.begin(), added.pixels.end(), pixel) == added.pixels.end())
            added.pixels.push_back(pixel);
        }
      outline.vertices.push_back(added);
    }
    return it->second;
  };
  for (Chain const& chain : find_chains(CrackGraph(links))) {
    auto kind = ChainSimplifier::Kind::between_nodes;
    if (chain.closed() && !graph.is_node(chain.corners.front())) kind = ChainSimplifier::Kind::free_loop;
    if (graph.degree(chain.corners.front()) == 1 && graph.degree(chain.corners.back()) == 1)
      kind = ChainSimplifier::Kind::slit;
    ChainSimplifier const simplifier(chain, kind);
    std::vector<ChainPlace> const places = simplifier.run();
    for (std::size_t k = 0; k + 1 < places.size(); ++k) {
      OutlineSegment segment;
      segment.from = vertex(simplifier.position(places[k]));
      segment.to = vertex(simplifier.position(places[k + 1]));
      auto const [first, end] = ChainSimplifier::passed(places[k], places[k + 1]);
      for (int index = first; index < end; ++index) segment.gates.push_back(simplifier.gate(index));
      outline.segments.push_back(std::move(segment));
    }
  }
  return outline;
}

}  // namespace scanview

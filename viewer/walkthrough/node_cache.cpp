#include "viewer/walkthrough/node_cache.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <optional>
#include <thread>

#include "base/error.h"
#include "mesh/node_mesh_file.h"
#include "viewer/walkthrough/walkthrough_file.h"

namespace scanview {
namespace {

namespace fs = std::filesystem;
using Clock = std::chrono::steady_clock;

class NodeCache final : public NodeLibrary {
 public:
  NodeCache(fs::path folder, NodeCacheOptions const& options)
      : folder_(std::move(folder)), options_(options), manifest_(read_walkthrough(folder_)) {
    for (auto const& node : manifest_.nodes) {
      positions_.push_back(node.position);
      slots_.emplace_back(node.levels.size());
      failures_.emplace_back(node.levels.size());
    }
    reader_ = std::thread([this] { read_wanted(); });
  }
  ~NodeCache() override {
    {
      std::lock_guard const lock(mutex_);
      ends_ = true;
    }
    wake_.notify_all();
    reader_.join();
  }

  std::vector<Eigen::Vector3d> const& positions() const override { return positions_; }
  double walking_radius() const override { return manifest_.walking_radius; }
  double focal_length() const override { return manifest_.focal_length; }

  std::shared_ptr<RasterNode const> get(std::size_t node, double distance, Wait wait) override {
    std::unique_lock lock(mutex_);
    ++clock_;
    std::optional<std::size_t> const level = usable_level(node, level_for(node, distance));
    if (!level) return nullptr;
    Slot& slot = slots_[node][*level];
    slot.used = clock_;
    if (slot.node) return slot.node;
    ask({node, *level});
    if (wait == Wait::yes) {
      ++slot.waiting;
      done_.wait(lock, [&] { return slot.node || !failures_[node][*level].empty(); });
      --slot.waiting;
      if (slot.node) return slot.node;
      lock.unlock();
      return get(node, distance, wait);
    }
    // Better another level than nothing.
    for (Slot& other : slots_[node]) {
      if (!other.node) continue;
      other.used = clock_;
      return other.node;
    }
    return nullptr;
  }

  std::vector<std::string> failures() const override {
    std::lock_guard const lock(mutex_);
    std::vector<std::string> lines;
    for (auto const& levels : failures_)
      for (std::string const& line : levels)
        if (!line.empty()) lines.push_back(line);
    return lines;
  }

  bool has_failed(std::size_t node) const override {
    std::lock_guard const lock(mutex_);
    return !usable_level(node, 0);
  }

  NodeTraffic traffic() const override {
    std::lock_guard const lock(mutex_);
    NodeTraffic traffic;
    for (auto const& levels : slots_)
      traffic.nodes += std::any_of(levels.begin(), levels.end(), [](Slot const& slot) { return slot.node != nullptr; });
    traffic.bytes = bytes_;
    traffic.waiting = asked_.size() + (is_reading_asked_ ? 1 : 0);
    traffic.settled = settled_;
    return traffic;
  }

  void follow(Eigen::Vector3d const& eye) override {
    auto const now = Clock::now();
    Eigen::Vector3d expected = eye;
    if (last_eye_) {
      double const seconds = std::chrono::duration<double>(now - last_time_).count();
      constexpr double kStill = 0.5;  // seconds: after a longer rest nothing is known
      if (seconds > 0 && seconds < kStill) {
        Eigen::Vector3d step = (eye - *last_eye_) / seconds * options_.seconds_ahead;
        // A jump is no walk.
        double const most = 10 * manifest_.walking_radius;
        if (step.norm() > most) step *= most / step.norm();
        expected += step;
      }
    }
    last_eye_ = eye;
    last_time_ = now;
    std::vector<std::pair<double, std::size_t>> nearest;
    for (std::size_t i = 0; i < positions_.size(); ++i) nearest.emplace_back((positions_[i] - expected).norm(), i);
    std::size_t const count = std::min(nearest.size(), std::size_t(options_.ahead));
    std::partial_sort(nearest.begin(), nearest.begin() + std::ptrdiff_t(count), nearest.end());
    std::lock_guard const lock(mutex_);
    ahead_.clear();  // what was expected from elsewhere
    for (std::size_t k = 0; k < count; ++k) {
      auto const [distance, node] = nearest[k];
      auto const level = usable_level(node, level_for(node, distance));
      if (level && !slots_[node][*level].node) ahead_.push_back({node, *level});
    }
    wake_.notify_all();
  }

 private:
  struct Slot {
    std::shared_ptr<RasterNode const> node;
    std::uint64_t used = 0;
    int waiting = 0;  ///< threads that wait for it: what is read meanwhile does not push it out
  };
  struct Wanted {
    std::size_t node, level;
    bool operator==(Wanted const&) const = default;
  };

  std::size_t level_for(std::size_t node, double distance) const {
    double const times = distance / (options_.full_detail * manifest_.walking_radius);
    if (!(times >= 1)) return 0;
    return std::min(std::size_t(std::log2(times)) + 1, slots_[node].size() - 1);
  }
  /// The level, or the nearest one that has not failed.
  std::optional<std::size_t> usable_level(std::size_t node, std::size_t level) const {
    auto const& failed = failures_[node];
    for (std::size_t step = 0; step < failed.size(); ++step)
      for (std::size_t const other : {level + step, level - step})
        if (other < failed.size() && failed[other].empty()) return other;
    return std::nullopt;
  }
  void ask(Wanted const& wanted) {
    if (std::find(asked_.begin(), asked_.end(), wanted) == asked_.end()) asked_.push_back(wanted);
    wake_.notify_all();
  }

  void read_wanted() {
    std::unique_lock lock(mutex_);
    while (true) {
      wake_.wait(lock, [&] { return ends_ || !asked_.empty() || !ahead_.empty(); });
      if (ends_) return;
      is_reading_asked_ = !asked_.empty();
      std::deque<Wanted>& next = is_reading_asked_ ? asked_ : ahead_;
      auto const [node, level] = next.front();
      next.pop_front();
      if (slots_[node][level].node || !failures_[node][level].empty()) {
        is_reading_asked_ = false;
        continue;
      }
      lock.unlock();
      std::shared_ptr<RasterNode const> read;
      std::string failure;
      try {
        read = std::make_shared<RasterNode>(read_node_mesh(folder_ / manifest_.nodes[node].levels[level]),
                                            options_.quality, manifest_.walking_radius);
      } catch (std::exception const& error) {
        failure = "node " + manifest_.nodes[node].name + ": " + error.what();
      }
      lock.lock();
      failures_[node][level] = failure;
      slots_[node][level].node = read;
      slots_[node][level].used = clock_;
      is_reading_asked_ = false;
      ++settled_;
      if (read) {
        bytes_ += read->bytes();
        forget({node, level});
      }
      done_.notify_all();
    }
  }

  /// Those longest not used, until what remains fits; never the one that was just read.
  void forget(Wanted const& just_read) {
    while (bytes_ > options_.bytes) {
      Slot* oldest = nullptr;
      for (std::size_t n = 0; n < slots_.size(); ++n)
        for (std::size_t l = 0; l < slots_[n].size(); ++l) {
          Slot& slot = slots_[n][l];
          if (!slot.node || slot.waiting > 0 || Wanted{n, l} == just_read) continue;
          if (oldest == nullptr || slot.used < oldest->used) oldest = &slot;
        }
      if (oldest == nullptr) return;
      bytes_ -= oldest->node->bytes();
      oldest->node.reset();
    }
  }

  fs::path folder_;
  NodeCacheOptions options_;
  WalkthroughManifest manifest_;
  std::vector<Eigen::Vector3d> positions_;
  std::optional<Eigen::Vector3d> last_eye_;
  Clock::time_point last_time_;

  mutable std::mutex mutex_;
  std::condition_variable wake_, done_;
  std::vector<std::vector<Slot>> slots_;            ///< a node, a level
  std::vector<std::vector<std::string>> failures_;  ///< a node, a level; empty: none
  std::deque<Wanted> asked_, ahead_;                ///< what a frame needs; what one will need
  std::size_t bytes_ = 0;
  std::uint64_t clock_ = 0;
  std::size_t settled_ = 0;
  bool is_reading_asked_ = false;  ///< what is being read is what a frame needs
  bool ends_ = false;
  std::thread reader_;
};

}  // namespace

void NodeCacheOptions::validate() const {
  if (ahead < 0) throw Error(ErrorCode::usage, {}, "node cache options: ahead must not be negative");
  if (!(seconds_ahead >= 0))
    throw Error(ErrorCode::usage, {}, "node cache options: seconds_ahead must not be negative");
  if (!(full_detail > 0)) throw Error(ErrorCode::usage, {}, "node cache options: full_detail must be greater than 0");
}

std::shared_ptr<NodeLibrary> open_node_library(fs::path const& folder, NodeCacheOptions const& options) {
  options.validate();
  return std::make_shared<NodeCache>(folder, options);
}

}  // namespace scanview

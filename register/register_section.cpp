#include "register/register_section.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "acquire/section_pictures.h"
#include "base/parallel.h"
#include "register/section_drawings.h"

namespace scanview {
namespace {

constexpr int kPictureWidth = 460;                    // CSS pixels
constexpr int kGraphWidth = 380, kMatrixWidth = 250;  // beside a plot
constexpr int kObserverWidth = 150;                   // of one picture of the heat map
constexpr std::size_t kMostMaps = 24;                 // views with a picture in the heat map
constexpr std::size_t kMapPixels = 20'000;
constexpr std::size_t kMostPairsListed = 60;
constexpr double kLookups = 4e7;    // of all views together, to tell which share of them others see
constexpr double kDistances = 1e7;  // of all pairs together: memory of the histograms
constexpr double kSlab = 0.015;     // half the cross-section's thickness, of the radius
constexpr double kGate = 0.05;      // of the radius
constexpr int kBins = 61;

PlotCurve histogram(std::vector<PairDistances> const& pairs, double reach, std::string name, std::string color) {
  std::vector<double> bins(kBins, 0);
  double count = 0;
  for (PairDistances const& pair : pairs)
    for (float d : pair.distances) {
      auto const bin = static_cast<int>(std::floor((d / reach + 1) / 2 * kBins));
      if (bin >= 0 && bin < kBins) bins[static_cast<std::size_t>(bin)] += 1;
      count += 1;
    }
  PlotCurve curve{std::move(name), {}, std::move(color), false};
  for (int k = 0; k < kBins; ++k)
    curve.points.emplace_back(((k + 0.5) / kBins * 2 - 1) * reach,
                              count > 0 ? 100 * bins[static_cast<std::size_t>(k)] / count : 0);
  return curve;
}

std::string length(double value, ScanSet const& set) { return fmt::format("{:.3g}{}", value, unit_suffix(set.unit)); }

std::string with_unit(std::string const& title, ScanSet const& set) {
  return set.unit == Unit::arbitrary ? title : fmt::format("{} ({})", title, to_string(set.unit));
}

std::string percent(double share) { return fmt::format("{:.0f}", 100 * share); }

/// The worst pairs first, all of them where they are few.
std::string pairs_table(ScanSet const& set, Alignment const& alignment, AlignmentReview const& review) {
  std::vector<std::size_t> order(alignment.pairs.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  bool const all = order.size() <= kMostPairsListed;
  if (!all) {
    std::stable_sort(order.begin(), order.end(), [&](std::size_t l, std::size_t r) {
      PairFigures const &pl = alignment.pairs[l], &pr = alignment.pairs[r];
      return std::pair(pl.suspicious, pl.median_distance) > std::pair(pr.suspicious, pr.median_distance);
    });
    order.resize(kMostPairsListed);
  }
  std::vector<std::vector<std::string>> rows{{"view", "view", "overlap %", with_unit("median before", set),
                                              with_unit("median after", set), with_unit("RMS after", set), "inliers %",
                                              "remark"}};
  PairFigures const* const worst = worst_pair(alignment);
  for (std::size_t const k : order) {
    PairFigures const& pair = alignment.pairs[k];
    std::string remark = pair.suspicious ? "suspicious" : "";
    if (&pair == worst && alignment.pairs.size() > 1) remark += remark.empty() ? "worst" : ", worst";
    PairDistances const& before = review.before[k];
    rows.push_back({set.views[pair.a].name, set.views[pair.b].name, percent(pair.overlap),
                    before.distances.empty() ? "no overlap" : fmt::format("{:.3g}", before.figures.median_distance),
                    fmt::format("{:.3g}", pair.median_distance), fmt::format("{:.3g}", pair.rms), percent(pair.inliers),
                    remark});
  }
  std::string const note = all ? std::string()
                               : fmt::format("<p>The {} worst of {} pairs; register.json has all.</p>\n", order.size(),
                                             alignment.pairs.size());
  return note + html_table(rows);
}

std::string views_table(ScanSet const& set, Alignment const& alignment, AlignmentReview const& review) {
  std::vector<std::string> part(set.views.size());
  if (alignment.parts.size() > 1)
    for (std::size_t p = 0; p < alignment.parts.size(); ++p)
      for (std::size_t const view : alignment.parts[p]) part[view] = std::to_string(p + 1);
  std::vector<std::vector<std::string>> rows{{"view", "part", "seen by others %", "rotation, standard deviation (deg)",
                                              with_unit("place, standard deviation", set)}};
  for (std::size_t i = 0; i < set.views.size(); ++i)
    rows.push_back({set.views[i].name, part[i], percent(review.seen[i]),
                    fmt::format("{:.3g}", alignment.poses[i].std_deg),
                    fmt::format("{:.3g}", alignment.poses[i].std_length)});
  return html_table(rows);
}

std::string status_sentence(ScanSet const& set, Alignment const& alignment, AlignmentReview const& review) {
  if (set.views.size() == 1) return "<p>A view alone: there is nothing to align.</p>\n";
  std::string text;
  switch (alignment.status) {
    case AlignmentStatus::converged:
      text = "The views settled";
      break;
    case AlignmentStatus::not_converged:
      text = "The views were not refined, or did not settle";
      break;
    case AlignmentStatus::disconnected:
      text = fmt::format("The views fall into {} parts that nothing joins", alignment.parts.size());
      break;
  }
  text += fmt::format(" after {} joint refinements over {} overlapping pairs of {} views.", alignment.iterations,
                      alignment.pairs.size(), set.views.size());
  if (std::isfinite(alignment.error.rms))
    text += fmt::format(
        " Registration's part of the error budget, the distance between overlapping surfaces: {} RMS, {} at the 95th "
        "percentile.",
        length(alignment.error.rms, set), length(alignment.error.p95, set));
  if (PairFigures const* const worst = worst_pair(alignment))
    text += fmt::format(" The worst pair is {} and {}: median distance {}, RMS {}, {} % overlap{}.",
                        set.views[worst->a].name, set.views[worst->b].name, length(worst->median_distance, set),
                        length(worst->rms, set), percent(worst->overlap), worst->suspicious ? "; it does not fit" : "");
  auto const suspicious = std::count_if(alignment.pairs.begin(), alignment.pairs.end(),
                                        [](PairFigures const& pair) { return pair.suspicious; });
  if (suspicious > 0) text += fmt::format(" Pairs that do not fit the others: {}.", suspicious);
  auto const least = std::min_element(review.seen.begin(), review.seen.end());
  text += fmt::format(" Others see least of {}: {} % of its depths.",
                      set.views[static_cast<std::size_t>(least - review.seen.begin())].name, percent(*least));
  for (std::string const& motion : alignment.unobservable) text += " Not held by the data: " + motion + ".";
  return "<p>" + html_escape(text) + "</p>\n";
}

std::string overlap_map(ScanSet const& set, AlignmentReview const& review) {
  int most = 1;
  for (Observers const& one : review.observers)
    most = std::max<int>(most, *std::max_element(one.counts.begin(), one.counts.end()));
  int const step = (most + 7) / 8;
  std::string html = "<p>How many other views see each part of the surface: ";
  for (int count = 0; count <= most; count = count == 0 ? 1 : count + step)
    html += fmt::format("{} {} &nbsp; ", color_swatch(observer_color(count, most)), count);
  html += review.observers.size() < set.views.size()
              ? fmt::format("The {} of {} views of which others see least.</p>\n", review.observers.size(),
                            set.views.size())
              : "</p>\n";
  std::vector<std::string> figures;
  for (Observers const& one : review.observers)
    figures.push_back(html_png(draw_observers(one, most),
                               fmt::format("{}: {} % seen", set.views[one.view].name, percent(review.seen[one.view])),
                               kObserverWidth));
  return html + html_row(figures);
}

/// Half of the pairs, of which there are some, have a larger median distance.
double usual_distance(Alignment const& alignment) {
  std::vector<double> distances;
  for (PairFigures const& pair : alignment.pairs) distances.push_back(pair.median_distance);
  auto const middle = distances.begin() + static_cast<std::ptrdiff_t>(distances.size() / 2);
  std::nth_element(distances.begin(), middle, distances.end());
  return *middle;
}

/// The graph, the matrix and the histogram of distances; nothing where no views overlap.
std::string pair_pictures(ScanSet const& set, Alignment const& alignment, AlignmentReview const& review) {
  if (alignment.pairs.empty()) return {};
  double const usual = usual_distance(alignment);
  std::vector<std::string> figures{
      html_png(draw_overlap_graph(set, alignment, usual),
               fmt::format("Which views overlap: thicker is more; green where the median distance is the usual {} or "
                           "less, red at three times that, and where the pair is suspicious",
                           length(usual, set)),
               kGraphWidth)};
  double const reach = std::isfinite(alignment.error.p95) && alignment.error.p95 > 0
                           ? 3 * alignment.error.p95
                           : std::max(kGate * review.radius, 1e-12);
  PlotOptions plot;
  plot.x_label = with_unit("distance between overlapping surfaces", set);
  plot.y_label = "% of the points";
  figures.push_back(html_png(draw_pair_matrix(alignment, set.views.size(), usual),
                             "Median distance of every pair, same colours, views in the set's order", kMatrixWidth));
  figures.push_back("<figure>" +
                    svg_plot({histogram(review.before, reach, "before", "#c0603a"),
                              histogram(review.after, reach, "after", "#2a7a4b")},
                             plot) +
                    "</figure>");
  return html_row(figures);
}

}  // namespace

PairFigures const* worst_pair(Alignment const& alignment) {
  auto const worst = std::max_element(
      alignment.pairs.begin(), alignment.pairs.end(),
      [](PairFigures const& l, PairFigures const& r) { return l.median_distance < r.median_distance; });
  return worst == alignment.pairs.end() ? nullptr : &*worst;
}

AlignmentReview review_alignment(ScanSet const& set, std::vector<Eigen::Isometry3d> const& before,
                                 Alignment const& alignment, Context& context) {
  std::size_t const n = set.views.size();
  double const pairs = std::max<double>(1, static_cast<double>(alignment.pairs.size()));
  auto const samples = static_cast<std::size_t>(std::clamp(kDistances / pairs, 1000.0, 12'000.0));
  std::vector<SurfacePyramid> surfaces(n);
  for_each_index(context, n, [&](std::size_t i) { surfaces[i] = build_pyramid(set.views[i].image, {1, samples}); });
  AlignmentReview result;
  for (SurfacePyramid const& surface : surfaces) result.radius = std::max(result.radius, surface.radius);
  double const gate = kGate * result.radius;

  std::vector<ViewGraphEdge> edges;
  for (PairFigures const& pair : alignment.pairs) edges.push_back({pair.a, pair.b, pair.overlap, pair.overlap});
  result.before = measure_pairs(set, surfaces, edges, before, gate, context);
  result.after = measure_pairs(set, surfaces, edges, alignment.object_from_camera, gate, context);

  auto const count = [&](std::size_t view, std::size_t pixels) {
    return count_observers(set, surfaces, alignment.object_from_camera, view, gate, pixels);
  };
  auto const pixels = static_cast<std::size_t>(std::clamp(kLookups / static_cast<double>(n * n), 1000.0, 4000.0));
  result.seen.resize(n);
  for_each_index(context, n, [&](std::size_t i) { result.seen[i] = count(i, pixels).seen; });
  std::vector<std::size_t> shown(n);
  std::iota(shown.begin(), shown.end(), std::size_t{0});
  std::stable_sort(shown.begin(), shown.end(),
                   [&](std::size_t l, std::size_t r) { return result.seen[l] < result.seen[r]; });
  shown.resize(n > 1 ? std::min(n, kMostMaps) : 0);
  std::sort(shown.begin(), shown.end());
  result.observers.resize(shown.size());
  for_each_index(context, shown.size(), [&](std::size_t k) { result.observers[k] = count(shown[k], kMapPixels); });
  return result;
}

ReportSection register_section(ScanSet const& set, std::vector<Eigen::Isometry3d> const& before,
                               Alignment const& alignment, AlignmentReview const& review) {
  ReportSection section{"register", "Registration", status_sentence(set, alignment, review)};
  CrossSections const cut = draw_cross_sections(set, before, alignment.object_from_camera, kSlab * review.radius);
  std::string const width = fmt::format("{} wide", length(cut.width, set));
  if (set.views.size() == 1) {
    section.html += html_png(cut.after, "Cross-section, " + width, kPictureWidth);
    return section;
  }
  section.html += html_row({html_png(cut.before, "Cross-section before, a colour a view, " + width, kPictureWidth),
                            html_png(cut.after, "The same section after", kPictureWidth)});
  section.html += pair_pictures(set, alignment, review) + overlap_map(set, review) +
                  pairs_table(set, alignment, review) + views_table(set, alignment, review);
  return section;
}

}  // namespace scanview

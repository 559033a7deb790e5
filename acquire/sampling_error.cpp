#include "acquire/sampling_error.h"

#include <algorithm>
#include <cmath>

namespace scanview {

ErrorPart sampling_error(ScanSet const& set) {
  constexpr std::size_t kThinned = 1'000'000;
  std::size_t total = 0;
  for (auto const& view : set.views) total += view.image.sigma.total();
  std::size_t const stride = std::max<std::size_t>(1, total / kThinned);
  std::vector<float> sigmas;
  std::size_t index = 0;
  for (auto const& view : set.views)
    for (float const sigma : view.image.sigma)
      if (index++ % stride == 0 && std::isfinite(sigma)) sigmas.push_back(sigma);
  if (sigmas.empty()) return {};
  double squares = 0;
  for (double const sigma : sigmas) squares += sigma * sigma;
  auto const at = sigmas.begin() + static_cast<std::ptrdiff_t>(0.95 * static_cast<double>(sigmas.size() - 1));
  std::nth_element(sigmas.begin(), at, sigmas.end());
  return {std::sqrt(squares / static_cast<double>(sigmas.size())), *at};
}

}  // namespace scanview

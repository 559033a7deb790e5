#include <cmath>

#include "acquire/import.h"
#include "base/error.h"

namespace scanview {

void ImportOptions::validate() const {
  auto const fail = [](char const* what) { throw Error(ErrorCode::usage, {}, what); };
  if (step < 1) fail("step must be 1 or more");
  if (!(min_depth >= 0)) fail("min_depth must not be negative");
  if (!(max_depth > min_depth)) fail("max_depth must be more than min_depth");
  if (box)
    for (int axis = 0; axis < 3; ++axis) {
      double const low = (*box)[0][axis], high = (*box)[1][axis];
      if (std::isnan(low) || std::isnan(high) || !(low < high))
        fail("box: every minimum must be less than its maximum");
    }
}

}  // namespace scanview

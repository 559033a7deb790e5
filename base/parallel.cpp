#include "base/parallel.h"

#include <oneapi/tbb/info.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include <algorithm>
#include <exception>
#include <vector>

namespace scanview {

void for_each_index(Context& context, std::size_t count, std::function<void(std::size_t)> const& work,
                    std::string const& stage) {
  std::vector<std::exception_ptr> errors(count);
  std::atomic<std::size_t> done = 0;
  auto const one = [&](std::size_t i) {
    try {
      context.check_cancelled();
      work(i);
      std::size_t const finished = ++done;
      if (!stage.empty()) context.progress(stage, finished, count);
    } catch (...) {
      errors[i] = std::current_exception();
    }
  };
  // More threads than processors gain nothing, and oneTBB would print a warning about them.
  int const processors = oneapi::tbb::info::default_concurrency();
  int const threads = context.threads > 0 ? std::min(context.threads, processors) : processors;
  oneapi::tbb::task_arena arena(threads);
  arena.execute([&] { oneapi::tbb::parallel_for(std::size_t{0}, count, one, oneapi::tbb::simple_partitioner()); });
  for (auto const& error : errors)
    if (error) std::rethrow_exception(error);
}

}  // namespace scanview

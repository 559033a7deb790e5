#include <fmt/format.h>
#include <malloc.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <atomic>
#include <chrono>
#include <csignal>
#include <iostream>
#include <opencv2/core.hpp>

#include "base/error.h"
#include "base/stage_record.h"
#include "cli/session.h"

namespace scanview {
namespace {

std::atomic<bool> interrupted = false;

/// The first Ctrl-C asks the work to stop between two steps, the second stops the program at once.
void on_interrupt(int) {
  if (interrupted.exchange(true)) std::_Exit(static_cast<int>(ErrorCode::interrupted));
}

/// A bar on stderr, redrawn in place, only where somebody sees it.
class ProgressBar {
 public:
  void show(std::string const& stage, std::size_t done, std::size_t total) {
    constexpr int kWidth = 30;
    int const filled = total ? static_cast<int>(kWidth * done / total) : 0;
    std::cerr << fmt::format("\r\033[K{:<10} [{}{}] {}/{}", stage, std::string(filled, '#'),
                             std::string(kWidth - filled, ' '), done, total)
              << std::flush;
    visible_ = true;
  }
  void clear() {
    if (visible_) std::cerr << "\r\033[K" << std::flush;
    visible_ = false;
  }

 private:
  bool visible_ = false;
};

void connect(Session& session, ProgressBar& bar) {
  Context& context = session.context;
  context.cancelled = &interrupted;
  if (!session.quiet) context.on_log = [&bar](std::string const& line) { bar.clear(), std::cerr << line << '\n'; };
  context.on_warning = [&bar](std::string const& line) { bar.clear(), std::cerr << "warning: " << line << '\n'; };
  if (!session.quiet && ::isatty(STDERR_FILENO))
    context.on_progress = [&bar](std::string const& stage, std::size_t done, std::size_t total) {
      bar.show(stage, done, total);
    };
}

/// Runs the verb; every failure becomes one line and an exit code.
int run_verb(Session& session, ProgressBar& bar) {
  std::string problem;
  int code = 0;
  try {
    session.work();
    code = session.exit_code;
  } catch (Error const& error) {
    code = static_cast<int>(error.code());
    problem = error.what();
  } catch (std::bad_alloc const&) {
    code = static_cast<int>(ErrorCode::io);
    problem = "out of memory";
  } catch (std::filesystem::filesystem_error const& error) {
    code = static_cast<int>(ErrorCode::io);
    problem = fmt::format("{}: {}", error.path1().string(), error.code().message());
  } catch (std::exception const& error) {
    code = static_cast<int>(ErrorCode::bad_input);
    problem = fmt::format("internal error, please report it: {}", error.what());
  }
  bar.clear();
  if (!problem.empty()) {
    std::cerr << "scanview: " << problem << '\n';
    session.report["error"] = problem;
  }
  return code;
}

int main(int argc, char** argv) {
  // Pictures come and go by the hundred: their memory is kept, since fresh pages cost up to a fifth of a run.
  ::mallopt(M_MMAP_THRESHOLD, 32 << 20);
  ::mallopt(M_TRIM_THRESHOLD, 1 << 30);
  std::signal(SIGINT, on_interrupt);
  std::signal(SIGTERM, on_interrupt);
  CLI::App app("Look at real, scanned objects from every side.", "scanview");
  app.set_version_flag("--version", version());
  app.require_subcommand(1);
  app.fallthrough();
  Session session;
  app.add_option("--report", session.report_path, "Write one JSON object with what was measured");
  app.add_option("--threads", session.context.threads, "At most so many threads (0: all processors)")
      ->check(CLI::NonNegativeNumber);
  app.add_option("--seed", session.context.seed, "Of every random choice");
  app.add_flag("--quiet", session.quiet, "No log, no progress; warnings and errors only");
  app.add_option("--set", session.settings, "STAGE.NAME=VALUE: any option of a stage")
      ->type_name("KEY=VALUE")
      ->allow_extra_args(false);
  for (AddVerb const add :
       {add_acquire, add_calibrate, add_import, add_register, add_mesh, add_view, add_visibility, add_walkthrough,
        add_ldi, add_render, add_evaluate, add_synth, add_run, add_export, add_info})
    add(app, session);
  try {
    app.parse(argc, argv);
  } catch (CLI::ParseError const& error) {
    int const code = app.exit(error, std::cout, std::cerr);
    return code == 0 ? 0 : static_cast<int>(ErrorCode::usage);
  }

  cv::setNumThreads(1);  // our own loops are parallel and ordered; OpenCV's would come on top
  ProgressBar bar;
  connect(session, bar);
  auto const start = std::chrono::steady_clock::now();
  int code = run_verb(session, bar);
  if (!session.report_path.empty()) {
    Json report = {{"verb", session.verb}, {"version", version()}};
    report["seconds"] = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    report["peak_mb"] = peak_memory_mb();
    report["warnings"] = session.context.warnings();
    report["exit"] = code;
    report.update(session.report);
    try {
      write_json(session.report_path, report);
    } catch (Error const& error) {
      std::cerr << "scanview: " << error.what() << '\n';
      code = static_cast<int>(error.code());
    }
  }
  return code;
}

}  // namespace
}  // namespace scanview

int main(int argc, char** argv) { return scanview::main(argc, argv); }

#include <CLI/CLI.hpp>
#include <memory>

#include "acquire/scan_set_file.h"
#include "cli/stages.h"
#include "viewer/window/view_window.h"

namespace scanview {

void add_view(CLI::App& app, Session& session) {
  struct Arguments {
    std::filesystem::path set;
    WindowOptions options;
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* verb = app.add_subcommand("view", "A window to turn the object in");
  verb->add_option("set", arguments->set, "The scan set, meshed")->required();
  verb->add_option("--width", arguments->options.width, "Of the window, in pixels");
  verb->add_option("--height", arguments->options.height, "Of the window, in pixels");
  verb->add_option("--pictures", arguments->options.pictures, "Folder where P saves pictures");
  verb->footer(window_help());
  verb->callback([arguments, &session] {
    session.verb = "view";
    session.work = [arguments, &session] {
      arguments->options.validate();
      ScanSet const set = read_scan_set(arguments->set, session.context);
      arguments->options.title = "scanview " + arguments->set.string();
      view_window(set, read_view_meshes(arguments->set, set, session.context), arguments->options, session.context);
    };
  });
}

}  // namespace scanview

#pragma once
#include <filesystem>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "base/context.h"
#include "base/files.h"

namespace CLI {
class App;
}

namespace scanview {

/// What all verbs share: the options that every one takes, the context its work runs in, and the report.
struct Session {
  Context context;
  std::filesystem::path report_path;  ///< --report; empty: none
  bool quiet = false;
  std::vector<std::string> settings;  ///< --set KEY=VALUE, as given
  Json report = Json::object();       ///< the verb's keys
  int exit_code = 0;  ///< 0; where what was done is not whole: 6 (part of the views failed), 3 (of damaged input)
  std::function<void()> work;  ///< set by the verb that was named
  std::string verb;
};

/// A verb adds itself to the command line and sets `work` when it is named.
using AddVerb = void (*)(CLI::App&, Session&);

void add_acquire(CLI::App& app, Session& session);
void add_calibrate(CLI::App& app, Session& session);
void add_import(CLI::App& app, Session& session);
void add_register(CLI::App& app, Session& session);
void add_mesh(CLI::App& app, Session& session);
void add_view(CLI::App& app, Session& session);
void add_render(CLI::App& app, Session& session);
void add_evaluate(CLI::App& app, Session& session);
void add_synth(CLI::App& app, Session& session);
void add_run(CLI::App& app, Session& session);
void add_export(CLI::App& app, Session& session);
void add_visibility(CLI::App& app, Session& session);
void add_walkthrough(CLI::App& app, Session& session);
void add_ldi(CLI::App& app, Session& session);
void add_info(CLI::App& app, Session& session);

/// One option of a stage that --set can reach, as "STAGE.NAME".
struct Setting {
  std::string name;
  std::function<void(std::string const&)> set;  ///< throws std::exception on a value it cannot take
};
/// Applies the settings of one stage. A key of this stage that is unknown, or a bad value, throws Error{usage}.
void apply_settings(std::vector<std::string> const& settings, std::string const& stage,
                    std::vector<Setting> const& known);
/// Throws Error{usage} for settings that are no KEY=VALUE or name none of the stages.
void check_settings(std::vector<std::string> const& settings, std::vector<std::string> const& stages);
Setting number_setting(std::string name, double& value);
Setting integer_setting(std::string name, int& value);

/// Most memory the process had in use since the last call of reset_peak_memory (where the kernel can), in MB.
double peak_memory_mb();
void reset_peak_memory();

}  // namespace scanview

#pragma once
// What somebody set up for themselves (V7, accessibility): size of text, colours, which panels are open, how
// far the tour has got. Kept as TOML in $XDG_CONFIG_HOME/handloft/hmd.toml. A file that cannot be read is
// told, never lost: it is moved aside before another one takes its name.

#include <filesystem>
#include <optional>
#include <string>

#include "client-hmd/render/colours.h"
#include "common/base/result.h"

namespace handloft::client {

inline constexpr int smallest_text_percent = 80, largest_text_percent = 250;
inline constexpr int text_percent_step = 10;
inline constexpr int tour_steps = 5;

struct HudSettings {
  int text_percent = 100;  ///< smallest_text_percent..largest_text_percent
  ColourScheme colours = ColourScheme::normal;
  bool left_open = true;
  bool right_open = true;
  bool tour_done = false;  ///< Finished or skipped: it does not begin by itself again.
  int tour_step = 0;       ///< Where it goes on, 0..tour_steps - 1.
  bool operator==(const HudSettings&) const = default;
};

/// The file of a person with that environment: XDG_CONFIG_HOME where it is absolute, else HOME/.config;
/// empty without either (nothing is kept then). Null: not set.
std::filesystem::path settings_path(const char* xdg_config_home, const char* home);

/// Errors: invalid_argument naming the line and what was found. `file_name`: for the message.
Result<HudSettings> parse_settings(std::string_view toml, const std::string& file_name);
std::string settings_toml(const HudSettings& settings);

class SettingsFile {
 public:
  /// `path` empty: load() gives defaults and save() does nothing.
  explicit SettingsFile(std::filesystem::path path) : path_(std::move(path)) {}

  struct Loaded {
    HudSettings settings;
    std::string warning;  ///< Why these are defaults although there is a file; empty: all is well.
  };
  /// Never fails: what cannot be read is a warning.
  Loaded load();
  /// Atomically: under a temporary name, synced, renamed; makes the folder. A file that load() could not read
  /// is renamed to NAME.damaged first. Errors: io, naming the path.
  Status save(const HudSettings& settings);

  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
  bool damaged_ = false;
};

}  // namespace handloft::client

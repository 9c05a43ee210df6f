#include "client-hmd/hud/settings.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <iterator>

#include "common/base/config.h"

namespace handloft::client {
namespace {

constexpr std::size_t largest_file_bytes = 65'536;  ///< A page of settings is a few hundred bytes.

Error io_error(const std::filesystem::path& path, const char* what) {
  return make_error(ErrorCode::io, fmt::format("{} {}: {}", what, path.string(), std::strerror(errno)));
}

Status write_synced(const std::filesystem::path& path, std::string_view text) {
  const int fd = ::open(path.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
  if (fd < 0) return io_error(path, "cannot create");
  Status status;
  while (!text.empty() && status.ok()) {
    const ssize_t written = ::write(fd, text.data(), text.size());
    if (written < 0 && errno == EINTR) continue;
    if (written < 0) {
      status = io_error(path, "cannot write");
    } else {
      text.remove_prefix(static_cast<std::size_t>(written));
    }
  }
  if (status.ok() && ::fsync(fd) != 0) status = io_error(path, "cannot write");
  if (::close(fd) != 0 && status.ok()) status = io_error(path, "cannot write");
  return status;
}

}  // namespace

std::filesystem::path settings_path(const char* xdg_config_home, const char* home) {
  // The XDG base directory specification: what is not absolute is ignored.
  if (xdg_config_home != nullptr && xdg_config_home[0] == '/') {
    return std::filesystem::path(xdg_config_home) / "handloft" / "hmd.toml";
  }
  if (home != nullptr && home[0] == '/') {
    return std::filesystem::path(home) / ".config" / "handloft" / "hmd.toml";
  }
  return {};
}

Result<HudSettings> parse_settings(std::string_view toml, const std::string& file_name) {
  HudSettings settings;
  std::string colours(colour_scheme_name(settings.colours));
  OptionTable table("handloft-hmd", "Settings of a person");
  TextRule schemes;
  for (const ColourScheme scheme : colour_schemes) schemes.choices.emplace_back(colour_scheme_name(scheme));
  table.add("text_percent", settings.text_percent, "Size of text",
            {.min = smallest_text_percent, .max = largest_text_percent});
  table.add("colours", colours, "Colour scheme", schemes);
  table.add("panels.left", settings.left_open, "The left column is open");
  table.add("panels.right", settings.right_open, "The right column is open");
  table.add("tour.done", settings.tour_done, "The tour does not begin by itself");
  table.add("tour.step", settings.tour_step, "Where the tour goes on", {.min = 0, .max = tour_steps - 1});
  if (const Status parsed = table.parse_toml(toml, file_name); !parsed) return parsed.error();
  settings.colours = colour_scheme_from(colours).value_or(ColourScheme::normal);
  return settings;
}

std::string settings_toml(const HudSettings& settings) {
  return fmt::format(
      "# Settings of handloft-hmd, written by its settings panel.\n"
      "text_percent = {}\n"
      "colours = \"{}\"\n\n"
      "[panels]\n"
      "left = {}\n"
      "right = {}\n\n"
      "[tour]\n"
      "done = {}\n"
      "step = {}\n",
      settings.text_percent, colour_scheme_name(settings.colours), settings.left_open, settings.right_open,
      settings.tour_done, settings.tour_step);
}

SettingsFile::Loaded SettingsFile::load() {
  damaged_ = false;
  std::error_code ignored;
  if (path_.empty() || !std::filesystem::exists(path_, ignored)) return {};
  const auto refuse = [this](const std::string& reason) {
    damaged_ = true;
    return Loaded{
        {},
        fmt::format("Your settings could not be read, so everything is as at first. {} The file stays "
                    "as it is until you change a setting; then it is kept as {}.damaged.",
                    reason, path_.filename().string())};
  };
  std::ifstream file(path_, std::ios::binary);
  std::string text(largest_file_bytes + 1, '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (file.bad() || (!file.eof() && file.fail()))
    return refuse(fmt::format("{} cannot be opened.", path_.string()));
  text.resize(static_cast<std::size_t>(file.gcount()));
  if (text.size() > largest_file_bytes)
    return refuse(fmt::format("{} is larger than {} bytes.", path_.string(), largest_file_bytes));
  Result<HudSettings> settings = parse_settings(text, path_.string());
  if (!settings) return refuse(settings.error().message + ".");
  return {*settings, {}};
}

Status SettingsFile::save(const HudSettings& settings) {
  if (path_.empty()) return {};
  std::error_code failure;
  std::filesystem::create_directories(path_.parent_path(), failure);
  if (failure) {
    return make_error(ErrorCode::io,
                      fmt::format("cannot create {}: {}", path_.parent_path().string(), failure.message()));
  }
  std::filesystem::path temporary = path_;
  temporary += fmt::format(".{}.tmp", ::getpid());
  std::error_code ignored;
  if (const Status written = write_synced(temporary, settings_toml(settings)); !written) {
    std::filesystem::remove(temporary, ignored);
    return written;
  }
  if (damaged_) {
    std::filesystem::path aside = path_;
    aside += ".damaged";
    std::filesystem::rename(path_, aside, failure);
    if (failure) {
      std::filesystem::remove(temporary, ignored);
      return make_error(ErrorCode::io, fmt::format("cannot keep {} as {}: {}", path_.string(), aside.string(),
                                                   failure.message()));
    }
    damaged_ = false;
  }
  std::filesystem::rename(temporary, path_, failure);
  if (failure) {
    std::filesystem::remove(temporary, ignored);
    return make_error(ErrorCode::io, fmt::format("cannot write {}: {}", path_.string(), failure.message()));
  }
  return {};
}

}  // namespace handloft::client

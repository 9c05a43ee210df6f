#include "server-model/main/cad_kernel_command.h"

#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <charconv>
#include <csignal>
#include <cstdint>
#include <fstream>
#include <optional>
#include <string_view>

#include "server-model/exchange/cad_job.h"

// Sanitizers reserve terabytes of address space for themselves.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define HANDLOFT_RESERVES_ADDRESS_SPACE
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer) || __has_feature(memory_sanitizer)
#define HANDLOFT_RESERVES_ADDRESS_SPACE
#endif
#endif

namespace handloft::model {
namespace {

std::optional<rlim_t> number(const std::string& text) {
  std::uint64_t value = 0;
  const auto [end, failed] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (failed != std::errc() || end != text.data() + text.size() || value == 0) return std::nullopt;
  return value;
}

void limit(decltype(RLIMIT_AS) what, rlim_t most) {
  const rlimit both{most, most};
  ::setrlimit(what, &both);
}

/// Bounds itself before it looks at anything. Each of these may fail where it is set tighter already.
void bound(rlim_t bytes, rlim_t seconds) {
  constexpr int gently = 5;  // The hand goes first.
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
#ifndef HANDLOFT_RESERVES_ADDRESS_SPACE
  limit(RLIMIT_AS, bytes);
#else
  static_cast<void>(bytes);
#endif
  const rlimit cpu{seconds, seconds + 1};  // SIGXCPU first, which tells why; then SIGKILL.
  ::setrlimit(RLIMIT_CPU, &cpu);
  limit(RLIMIT_CORE, 0);
  ::setpriority(PRIO_PROCESS, 0, gently);
  std::ofstream("/proc/self/oom_score_adj") << 1000;  // And rather this one than the model.
}

std::optional<std::string> read_all(int from) {
  constexpr std::size_t chunk = 1U << 16U;
  std::array<char, chunk> buffer{};
  std::string bytes;
  for (;;) {
    const ssize_t got = ::read(from, buffer.data(), buffer.size());
    if (got == 0) return bytes;
    if (got < 0 && errno != EINTR) return std::nullopt;
    if (got > 0) bytes.append(buffer.data(), static_cast<std::size_t>(got));
  }
}

bool write_all(int to, std::string_view bytes) {
  while (!bytes.empty()) {
    const ssize_t sent = ::write(to, bytes.data(), bytes.size());
    if (sent < 0 && errno != EINTR) return false;
    if (sent > 0) bytes.remove_prefix(static_cast<std::size_t>(sent));
  }
  return true;
}

}  // namespace

ExitStatus cad_kernel_command(const std::vector<std::string>& arguments) {
  const auto bytes = arguments.size() == 2 ? number(arguments[0]) : std::nullopt;
  const auto seconds = arguments.size() == 2 ? number(arguments[1]) : std::nullopt;
  if (!bytes || !seconds) return exit_usage;
  bound(*bytes, *seconds);
  const auto request = read_all(STDIN_FILENO);
  const bool done = request && write_all(STDIN_FILENO, exchange::perform_cad_job(*request));
  ::_exit(done ? exit_ok : exit_failed);  // What the library left behind shall not trip it up now.
}

}  // namespace handloft::model

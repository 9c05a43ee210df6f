#include "server-model/session/cad_process.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <csignal>
#include <cstring>
#include <utility>

#include "server-model/exchange/cad_job.h"

namespace handloft::session {

namespace fs = std::filesystem;
using exchange::CadContent;
using exchange::CadImportOptions;
using exchange::CadText;
using exchange::CadTextFormat;
using exchange::ImportedModel;
using exchange::ImportedReference;
using exchange::ReferenceFormat;
using exchange::ReferenceOptions;
using exchange::StepOptions;

namespace {

Error refused(const char* doing, int number) {
  return make_error(ErrorCode::io,
                    fmt::format("the CAD kernel's process could not be {}: {}", doing, std::strerror(number)),
                    "path");
}

/// An open file of ours, closed with it.
class Handle {
 public:
  Handle() = default;
  explicit Handle(int number) : number_(number) {}
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  ~Handle() { close(); }
  void close() {
    if (number_ >= 0) ::close(number_);
    number_ = -1;
  }
  int number() const { return number_; }

 private:
  int number_ = -1;
};

/// The process, which is no more when this is no more.
class Child {
 public:
  explicit Child(pid_t pid) : pid_(pid) {}
  Child(const Child&) = delete;
  Child& operator=(const Child&) = delete;
  ~Child() {
    if (pid_ > 0) end();
  }
  /// Kills it if it still runs; the status of wait().
  int end() {
    ::kill(pid_, SIGKILL);
    return wait();
  }
  int wait() {
    int status = 0;
    while (::waitpid(pid_, &status, 0) < 0 && errno == EINTR) {
    }
    pid_ = -1;
    return status;
  }

 private:
  pid_t pid_;
};

/// With `socket` as its standard input, nothing else open, and no signal blocked or ignored.
Result<pid_t> start(const CadProcessOptions& options, int socket) {
  const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(options.max_cpu).count();
  std::array<std::string, 4> words{options.program.string(), "cad-kernel",
                                   std::to_string(options.max_memory_bytes), std::to_string(seconds)};
  std::array<char*, 5> arguments{words[0].data(), words[1].data(), words[2].data(), words[3].data(), nullptr};
  posix_spawn_file_actions_t files;
  posix_spawn_file_actions_init(&files);
  posix_spawn_file_actions_adddup2(&files, socket, STDIN_FILENO);
  posix_spawn_file_actions_addopen(&files, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_addopen(&files, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_addclosefrom_np(&files, STDERR_FILENO + 1);
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  sigset_t none;
  sigset_t all;
  sigemptyset(&none);
  sigfillset(&all);
  posix_spawnattr_setsigmask(&attributes, &none);
  posix_spawnattr_setsigdefault(&attributes, &all);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF);
  pid_t pid = -1;
  const int failed =
      ::posix_spawn(&pid, options.program.c_str(), &files, &attributes, arguments.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&files);
  if (failed != 0) return refused("started", failed);
  return pid;
}

using Deadline = std::chrono::steady_clock::time_point;

/// As poll() takes it.
int milliseconds_to(Deadline deadline) {
  using std::chrono::milliseconds;
  constexpr milliseconds longest_look = std::chrono::minutes(1);
  const auto left = std::chrono::ceil<milliseconds>(deadline - std::chrono::steady_clock::now());
  return static_cast<int>(std::clamp(left, milliseconds(0), longest_look).count());
}

Status check_time(Deadline deadline, const CadProcessOptions& options) {
  if (std::chrono::steady_clock::now() < deadline) return {};
  const auto seconds = std::chrono::duration<double>(options.max_time).count();
  return make_error(ErrorCode::timeout,
                    fmt::format("the CAD kernel did not come to an end with it in {:.3g} s", seconds),
                    "path");
}

/// Until the process has ended, which is at once after its answer.
Status wait_for_end(pid_t pid, Deadline deadline, const CadProcessOptions& options) {
  // glibc 2.36 declares pidfd_open() for C only.
  const Handle process(static_cast<int>(::syscall(SYS_pidfd_open, pid, 0)));
  if (process.number() < 0) return refused("waited for", errno);
  for (;;) {
    if (Status in_time = check_time(deadline, options); !in_time) return in_time;
    pollfd look{process.number(), POLLIN, 0};
    const int ready = ::poll(&look, 1, milliseconds_to(deadline));
    if (ready > 0) return {};
    if (ready < 0 && errno != EINTR) return refused("waited for", errno);
  }
}

/// Sends the request while there is some left, and takes what comes of the answer until its end. An end
/// that comes too early is no error here: the process has ended, and its status says more.
Status talk(int socket, std::string_view request, Deadline deadline, const CadProcessOptions& options,
            std::string& answer) {
  constexpr std::size_t chunk = 1U << 16U;
  std::array<char, chunk> buffer{};
  for (bool sending = true;;) {
    if (Status in_time = check_time(deadline, options); !in_time) return in_time;
    pollfd look{socket, static_cast<short>(sending ? POLLIN | POLLOUT : POLLIN), 0};
    if (::poll(&look, 1, milliseconds_to(deadline)) < 0 && errno != EINTR) {
      return refused("waited for", errno);
    }
    if ((look.revents & POLLOUT) != 0) {
      const ssize_t sent = ::send(socket, request.data(), std::min(request.size(), chunk), MSG_NOSIGNAL);
      if (sent > 0) request.remove_prefix(static_cast<std::size_t>(sent));
      if (request.empty() || (sent < 0 && errno != EAGAIN && errno != EINTR)) {
        ::shutdown(socket, SHUT_WR);
        sending = false;
      }
    }
    if ((look.revents & (POLLIN | POLLHUP | POLLERR)) == 0) continue;
    const ssize_t got = ::recv(socket, buffer.data(), buffer.size(), 0);
    if (got == 0 || (got < 0 && errno != EAGAIN && errno != EINTR)) return {};
    if (got < 0) continue;
    answer.append(buffer.data(), static_cast<std::size_t>(got));
    if (answer.size() > options.max_answer_bytes) {
      return make_error(ErrorCode::resource_exhausted,
                        fmt::format("the CAD kernel made more than {} bytes of it", options.max_answer_bytes),
                        "path");
    }
  }
}

Error failure_of(int status, const CadProcessOptions& options) {
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGXCPU) {
    const auto seconds = std::chrono::duration<double>(options.max_cpu).count();
    return make_error(
        ErrorCode::resource_exhausted,
        fmt::format("the CAD kernel did not come to an end with it in {:.0f} s of CPU time", seconds),
        "path");
  }
  const std::string how =
      WIFSIGNALED(status)
          ? fmt::format("killed by signal {} ({})", WTERMSIG(status), ::strsignal(WTERMSIG(status)))
          : fmt::format("its process ended with status {}", WEXITSTATUS(status));
  return make_error(ErrorCode::data_corrupt, fmt::format("the CAD kernel failed on it: {}", how), "path");
}

Error named(Error error, const fs::path& path) {
  error.message = fmt::format("{}: {}", path.filename().string(), error.message);
  return error;
}

/// The other process begins in our folder, but paths shall not depend on that.
fs::path whole_path(const fs::path& path) {
  std::error_code failed;
  fs::path whole = std::filesystem::absolute(path, failed);
  return failed ? path : whole;
}

}  // namespace

Result<std::string> CadProcess::perform(const std::string& request) const {
  std::array<int, 2> ends{};
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0)
    return refused("reached", errno);
  const Handle ours(ends[0]);
  Handle theirs(ends[1]);
  const int flags = ::fcntl(ours.number(), F_GETFL);
  if (flags < 0 || ::fcntl(ours.number(), F_SETFL, flags | O_NONBLOCK) != 0) return refused("reached", errno);
  const auto pid = start(options_, theirs.number());
  if (!pid) return pid.error();
  Child child(*pid);
  theirs.close();
  std::string answer;
  const Deadline deadline = std::chrono::steady_clock::now() + options_.max_time;
  if (Status talked = talk(ours.number(), request, deadline, options_, answer); !talked)
    return talked.error();
  if (Status ended = wait_for_end(*pid, deadline, options_); !ended) return ended.error();
  const int status = child.wait();
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0) return failure_of(status, options_);
  return answer;
}

Result<ImportedModel> CadProcess::import_model(const fs::path& path, const CadImportOptions& options,
                                               Duration triangles_within) const {
  const auto answer = perform(exchange::model_request(whole_path(path), options, triangles_within));
  return answer ? exchange::model_answer(*answer) : named(answer.error(), path);
}

Result<ImportedReference> CadProcess::import_reference(const fs::path& path,
                                                       const ReferenceOptions& options) const {
  const auto format = exchange::reference_format(path);
  if (!format || (*format != ReferenceFormat::step && *format != ReferenceFormat::iges)) {
    return CadKernel::import_reference(path, options);
  }
  const auto answer = perform(exchange::reference_request(whole_path(path), options));
  return answer ? exchange::reference_answer(*answer) : named(answer.error(), path);
}

Result<CadText> CadProcess::text(CadTextFormat format, const std::string& file_name,
                                 const CadContent& content, const StepOptions& options) const {
  const auto answer = perform(exchange::text_request(format, file_name, content, options));
  if (answer) return exchange::text_answer(*answer);
  Error error = answer.error();
  if (error.code == ErrorCode::data_corrupt) error.code = ErrorCode::internal;  // No file is to blame.
  return named(error, file_name);
}

}  // namespace handloft::session

#include "tests/support/process.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <utility>

namespace handloft::test {

namespace {

using Deadline = std::chrono::steady_clock::time_point;

bool wait_readable(int descriptor, Deadline deadline) {
  for (;;) {
    const auto left =
        std::chrono::duration_cast<std::chrono::milliseconds>(deadline - std::chrono::steady_clock::now());
    pollfd entry{descriptor, POLLIN, 0};
    const int ready = poll(&entry, 1, static_cast<int>(std::max<std::int64_t>(0, left.count())));
    if (ready > 0) return true;
    if (ready == 0) return false;
    if (errno != EINTR) return false;
  }
}

}  // namespace

Process::Process(const std::vector<std::string>& arguments, std::filesystem::path error_log,
                 const std::vector<std::string>& environment)
    : error_log_(std::move(error_log)) {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) throw std::runtime_error("no pipe");
  std::vector<char*> argv;
  for (const std::string& argument : arguments) argv.push_back(const_cast<char*>(argument.c_str()));
  argv.push_back(nullptr);
  const int log = open(error_log_.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
  const int nothing = open("/dev/null", O_RDONLY | O_CLOEXEC);
  pid_ = fork();
  if (pid_ == 0) {
    dup2(nothing, STDIN_FILENO);
    dup2(ends[1], STDOUT_FILENO);
    dup2(log, STDERR_FILENO);
    for (const std::string& entry : environment) putenv(const_cast<char*>(entry.c_str()));
    execv(argv[0], argv.data());
    _exit(127);
  }
  close(ends[1]);
  close(log);
  close(nothing);
  output_ = ends[0];
  if (pid_ < 0) throw std::runtime_error("cannot start " + arguments.at(0));
  pid_handle_ = static_cast<int>(syscall(SYS_pidfd_open, pid_, 0));
}

Process::~Process() {
  if (!status_) {
    kill(pid_, SIGKILL);
    wait(std::chrono::seconds(10));
  }
  if (output_ >= 0) close(output_);
  if (pid_handle_ >= 0) close(pid_handle_);
}

bool Process::fill(Deadline deadline) {
  if (output_ < 0 || !wait_readable(output_, deadline)) return false;
  char buffer[4096];
  const ssize_t count = read(output_, buffer, sizeof buffer);
  if (count <= 0) {
    close(output_);
    output_ = -1;
    return false;
  }
  pending_.append(buffer, static_cast<std::size_t>(count));
  return true;
}

std::optional<std::string> Process::read_line(std::chrono::milliseconds timeout) {
  const Deadline deadline = std::chrono::steady_clock::now() + timeout;
  for (;;) {
    if (const std::size_t end = pending_.find('\n'); end != std::string::npos) {
      std::string line = pending_.substr(0, end);
      pending_.erase(0, end + 1);
      return line;
    }
    if (!fill(deadline)) return std::nullopt;
  }
}

std::string Process::read_all(std::chrono::milliseconds timeout) {
  const Deadline deadline = std::chrono::steady_clock::now() + timeout;
  while (fill(deadline)) {
  }
  return std::exchange(pending_, {});
}

std::optional<int> Process::wait(std::chrono::milliseconds timeout) {
  if (status_) return status_;
  if (!wait_readable(pid_handle_, std::chrono::steady_clock::now() + timeout)) return std::nullopt;
  int raw = 0;
  if (waitpid(pid_, &raw, 0) != pid_) return std::nullopt;
  status_ = WIFEXITED(raw) ? WEXITSTATUS(raw) : 128 + WTERMSIG(raw);
  return status_;
}

void Process::signal(int number) const {
  if (!status_) kill(pid_, number);
}

std::string Process::error_output() const {
  std::ifstream in(error_log_);
  return {std::istreambuf_iterator<char>(in), {}};
}

std::filesystem::path program(const std::string& name) {
  if (const char* folder = std::getenv("HANDLOFT_BIN")) return std::filesystem::path(folder) / name;
  return std::filesystem::read_symlink("/proc/self/exe").parent_path() / name;
}

}  // namespace handloft::test

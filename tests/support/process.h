#pragma once
// A real process under test: started with arguments, its standard output read line by line with a deadline,
// ended and reaped with the object. Standard error goes to a file, so that a failing test can show it.

#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

namespace handloft::test {

class Process {
 public:
  /// Starts `arguments[0]` (a path). Throws std::runtime_error when it cannot be started.
  /// `environment` entries ("NAME=value") are added to this process's own.
  Process(const std::vector<std::string>& arguments, std::filesystem::path error_log,
          const std::vector<std::string>& environment = {});
  ~Process();  ///< Kills it when it still runs.
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  /// The next line of standard output without its newline; nullopt at its end or when the time is up.
  std::optional<std::string> read_line(std::chrono::milliseconds timeout);
  /// Everything that is still to come on standard output, until its end or until the time is up.
  std::string read_all(std::chrono::milliseconds timeout);
  /// The exit status (128 + signal when killed); nullopt when it still runs after the time.
  std::optional<int> wait(std::chrono::milliseconds timeout);
  void signal(int number) const;
  pid_t pid() const { return pid_; }
  /// What it wrote to standard error so far.
  std::string error_output() const;

 private:
  bool fill(std::chrono::steady_clock::time_point deadline);

  pid_t pid_ = -1;
  int output_ = -1;
  int pid_handle_ = -1;
  std::string pending_;
  std::optional<int> status_;
  std::filesystem::path error_log_;
};

/// The folder of the built programs: $HANDLOFT_BIN, else where the running test itself lies.
std::filesystem::path program(const std::string& name);

}  // namespace handloft::test

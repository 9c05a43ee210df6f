#pragma once
// A device of devices/ that a test drives by lines (devices/control.h): a process of its own, in the guest.

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <cstdlib>
#include <deque>
#include <filesystem>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

namespace handloft::test {

class DrivenDevice {
 public:
  /// `command[0]`: the program's name, beside the test's own.
  explicit DrivenDevice(std::vector<std::string> command) {
    int to[2], from[2];
    if (::pipe(to) != 0 || ::pipe(from) != 0) std::abort();
    process_ = ::fork();
    if (process_ == 0) {
      ::dup2(to[0], 0);
      ::dup2(from[1], 1);
      ::close(to[1]);
      ::close(from[0]);
      const auto folder = std::filesystem::read_symlink("/proc/self/exe").parent_path();
      command[0] = (folder / command[0]).string();
      std::vector<char*> words;
      for (std::string& word : command) words.push_back(word.data());
      words.push_back(nullptr);
      ::execv(words[0], words.data());
      std::_Exit(127);
    }
    ::close(to[0]);
    ::close(from[1]);
    commands_ = to[1];
    words_ = ::fdopen(from[0], "r");
    reader_ = std::thread([this] { listen(); });
  }
  ~DrivenDevice() {
    ::close(commands_);
    ::waitpid(process_, nullptr, 0);
    reader_.join();
    ::fclose(words_);
  }
  DrivenDevice(const DrivenDevice&) = delete;
  DrivenDevice& operator=(const DrivenDevice&) = delete;

  void tell(const std::string& line) const {
    const std::string text = line + "\n";
    EXPECT_EQ(::write(commands_, text.data(), text.size()), static_cast<ssize_t>(text.size()));
  }
  /// Waits for a line that begins so; what came before it is forgotten.
  std::string hear(const std::string& beginning) {
    std::unique_lock lock(mutex_);
    std::string found;
    changed_.wait_for(lock, std::chrono::seconds(20), [&] {
      while (!heard_.empty() && found.empty()) {
        if (heard_.front().starts_with(beginning)) found = heard_.front();
        heard_.pop_front();
      }
      return !found.empty();
    });
    EXPECT_FALSE(found.empty()) << "the device never said: " << beginning;
    return found;
  }

 private:
  void listen() {
    char line[512];
    while (std::fgets(line, sizeof line, words_) != nullptr) {
      std::string text(line);
      while (!text.empty() && text.back() == '\n') text.pop_back();
      const std::lock_guard lock(mutex_);
      heard_.push_back(text);
      changed_.notify_all();
    }
  }
  pid_t process_ = -1;
  int commands_ = -1;
  FILE* words_ = nullptr;
  std::thread reader_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::string> heard_;
};

}  // namespace handloft::test

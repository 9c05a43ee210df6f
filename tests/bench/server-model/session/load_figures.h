#pragma once
// What the load tools of a session measure: latencies in fine bins, so that many rounds can be drawn anew for
// a bootstrap interval (Efron 1979), and what a process uses.

#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/types.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "common/net/endpoint.h"

namespace handloft::session {

/// Bins of 2 % from 0.01 ms to 100 s: their edges are the error of a percentile.
class Latencies {
 public:
  void add(double milliseconds) {
    const double place = std::log(std::max(milliseconds, first_ms) / first_ms) / std::log(growth);
    ++bins_[std::min(bins_.size() - 1, static_cast<std::size_t>(place))];
    ++count_;
    most_ = std::max(most_, milliseconds);
  }
  void add(const Latencies& others) {
    for (std::size_t i = 0; i < bins_.size(); ++i) bins_[i] += others.bins_[i];
    count_ += others.count_;
    most_ = std::max(most_, others.most_);
  }
  /// The middle of its bin; 0 of none.
  double percentile(double part) const {
    const auto wanted = static_cast<std::uint64_t>(part * static_cast<double>(count_));
    std::uint64_t below = 0;
    for (std::size_t i = 0; i < bins_.size(); ++i) {
      below += bins_[i];
      if (below > wanted) return first_ms * std::pow(growth, static_cast<double>(i) + 0.5);
    }
    return count_ == 0 ? 0 : most_;
  }
  std::uint64_t count() const { return count_; }
  double most() const { return most_; }

 private:
  static constexpr double first_ms = 0.01;
  static constexpr double growth = 1.02;
  std::vector<std::uint64_t> bins_ = std::vector<std::uint64_t>(814);
  std::uint64_t count_ = 0;
  double most_ = 0;
};

struct Interval {
  double low = 0, middle = 0, high = 0;
};

/// Of the ratio of two percentiles, each of all rounds together: 95 %, rounds drawn anew with their partner,
/// since what else the machine does lasts longer than one of them.
inline Interval ratio_of_percentiles(const std::vector<Latencies>& these, const std::vector<Latencies>& to,
                                     double part) {
  constexpr int draws = 1000;
  std::mt19937_64 random(1);
  std::vector<double> ratios;
  const std::size_t rounds = std::min(these.size(), to.size());
  const auto ratio = [&](const auto& round_of) {
    Latencies above, below;
    for (std::size_t i = 0; i < rounds; ++i) {
      above.add(these[round_of(i)]);
      below.add(to[round_of(i)]);
    }
    return above.percentile(part) / below.percentile(part);
  };
  for (int draw = 0; draw < draws && rounds > 0; ++draw) {
    std::vector<std::size_t> drawn(rounds);
    for (std::size_t& one : drawn) one = random() % rounds;
    ratios.push_back(ratio([&](std::size_t i) { return drawn[i]; }));
  }
  if (ratios.empty()) return {};
  std::sort(ratios.begin(), ratios.end());
  return {ratios[ratios.size() / 40], ratio([](std::size_t i) { return i; }),
          ratios[ratios.size() - 1 - ratios.size() / 40]};
}

/// A straight line through what was seen over time, and how sure its slope is.
struct Slope {
  double per_s = 0;
  double standard_error = 0;
};
inline Slope fitted_slope(const std::vector<std::pair<double, double>>& seen) {
  if (seen.size() < 3) return {};
  const auto n = static_cast<double>(seen.size());
  double mean_t = 0, mean_y = 0, tt = 0, ty = 0, residual = 0;
  for (const auto& [t, y] : seen) {
    mean_t += t / n;
    mean_y += y / n;
  }
  for (const auto& [t, y] : seen) {
    tt += (t - mean_t) * (t - mean_t);
    ty += (t - mean_t) * (y - mean_y);
  }
  const double slope = ty / tt;
  for (const auto& [t, y] : seen) {
    const double off = y - mean_y - slope * (t - mean_t);
    residual += off * off;
  }
  return {slope, std::sqrt(residual / (n - 2) / tt)};
}

inline double rss_mib(pid_t pid) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/statm");
  std::uint64_t size = 0, resident = 0;
  file >> size >> resident;
  return static_cast<double>(resident) * static_cast<double>(::sysconf(_SC_PAGESIZE)) / (1 << 20);
}

/// What the server says of its own heap (handloft_process_heap_bytes); 0: it does not answer.
inline double heap_mib(const net::Endpoint& metrics) {
  const auto socket = net::connect_to(metrics, 1000);
  const std::string request = "GET /metrics HTTP/1.0\r\n\r\n";
  if (!socket || ::send(socket->get(), request.data(), request.size(), MSG_NOSIGNAL) < 0) return 0;
  std::string answer;
  std::array<char, 4096> buffer{};
  for (ssize_t got = 0; (got = ::recv(socket->get(), buffer.data(), buffer.size(), 0)) > 0;)
    answer.append(buffer.data(), static_cast<std::size_t>(got));
  const std::string name = "\nhandloft_process_heap_bytes ";
  const std::size_t at = answer.find(name);
  return at == std::string::npos ? 0 : std::atof(answer.c_str() + at + name.size()) / (1 << 20);
}

inline double cpu_s(pid_t pid) {
  std::ifstream file("/proc/" + std::to_string(pid) + "/stat");
  std::string word;
  double ticks = 0;
  for (int i = 1; file >> word && i <= 15; ++i) {
    if (i == 14 || i == 15) ticks += std::atof(word.c_str());
  }
  return ticks / static_cast<double>(::sysconf(_SC_CLK_TCK));
}

inline double own_cpu_s() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + 1e-6 * static_cast<double>(time.tv_usec);
  };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

}  // namespace handloft::session

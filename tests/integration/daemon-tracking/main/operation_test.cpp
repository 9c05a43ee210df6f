// The daemon in operation, as a real process: commands, metrics, traces, reload, socket activation, who may
// ask it, and recordings that outlive it.

#include <fcntl.h>
#include <fmt/format.h>
#include <fnmatch.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <random>
#include <set>
#include <thread>

#include "common/net/message_client.h"
#include "common/record/recording.h"
#include "daemon-tracking/source/glove_report.h"
#include "daemon-tracking/source/space_mouse/space_mouse_report.h"
#include "proto/session.pb.h"
#include "tests/support/process.h"
#include "tests/support/test_data.h"

namespace handloft::tracking {
namespace {

using namespace std::chrono_literals;
constexpr std::chrono::milliseconds patience{30000};

class TrackdOperation : public testing::Test {
 protected:
  std::filesystem::path file(const std::string& name) const { return folder_.path() / name; }
  std::string endpoint() const { return "unix:" + file("t.sock").string(); }
  std::vector<std::string> command(std::vector<std::string> more) const {
    std::vector<std::string> all{test::program("handloft-trackd").string()};
    all.insert(all.end(), more.begin(), more.end());
    all.insert(all.end(), {"--listen", endpoint()});
    return all;
  }
  std::unique_ptr<test::Process> start(std::vector<std::string> more,
                                       const std::vector<std::string>& environment = {}) const {
    return std::make_unique<test::Process>(command(std::move(more)), file("errors.txt"), environment);
  }
  net::SyncClient subscribe(v1::Subscribe::Delivery delivery = v1::Subscribe::LATEST) const {
    net::ClientOptions options;
    options.role = v1::ROLE_SUBSCRIBER;
    // A process needs a moment to listen; the client retries by itself.
    auto client = net::SyncClient::connect(*net::parse_endpoint(endpoint()), options, clock_);
    if (!client.ok()) throw std::runtime_error(client.error().describe());
    v1::Envelope subscribe;
    subscribe.mutable_subscribe()->set_delivery(delivery);
    EXPECT_TRUE(client->send(subscribe).ok());
    return std::move(*client);
  }
  static v1::TrackingFrame next_frame(net::SyncClient& client) {
    auto message = client.receive(patience);
    EXPECT_TRUE(message.ok()) << message.error().describe();
    return message.ok() ? std::move(*message->mutable_tracking()) : v1::TrackingFrame();
  }
  // Follows until so many frames came that a camera's picture made, and the health of all devices after them:
  // on a busy machine the simulated cameras begin late.
  static void follow_cameras(net::SyncClient& client, int frames) {
    const auto exposed = [](const v1::TrackingFrame& frame) {
      return std::any_of(frame.cameras().begin(), frame.cameras().end(),
                         [](const v1::CameraState& camera) { return camera.exposure_time_ns() > 0; });
    };
    for (int seen = 0; seen < frames && !HasFailure();)
      if (exposed(next_frame(client))) ++seen;
    while (!HasFailure() && next_frame(client).devices_size() == 0) {
    }
  }
  int run(std::vector<std::string> more, std::string* output = nullptr) const {
    test::Process process(command(std::move(more)), file("errors-2.txt"));
    const std::string said = process.read_all(patience);
    if (output != nullptr) *output = said;
    return process.wait(patience).value_or(-1);
  }
  // The samples in a recording, and how it ended.
  static std::pair<std::uint64_t, record::RecordingEnd> read_recording(const std::filesystem::path& path) {
    auto reader = record::RecordingReader::open(path);
    EXPECT_TRUE(reader.ok()) << reader.error().describe();
    if (!reader.ok()) return {0, record::RecordingEnd::truncated};
    std::uint64_t records = 0;
    for (;;) {
      const auto next = reader->next();
      EXPECT_TRUE(next.ok()) << next.error().describe();
      if (!next.ok() || !next->has_value()) break;
      ++records;
    }
    return {records, reader->end()};
  }
  static std::string http_get(const std::string& socket_path, const std::string& request) {
    const auto fd = net::connect_to(*net::parse_endpoint("unix:" + socket_path), 5000);
    if (!fd.ok()) return fd.error().describe();
    if (::send(fd->get(), request.data(), request.size(), MSG_NOSIGNAL) < 0) return "not sent";
    std::string answer(1 << 16, '\0');
    std::size_t got = 0;
    for (ssize_t n = 0; got < answer.size(); got += static_cast<std::size_t>(n)) {
      n = ::recv(fd->get(), answer.data() + got, answer.size() - got, 0);
      if (n <= 0) break;
    }
    answer.resize(got);
    return answer;
  }

  const SystemClock clock_{};
  test::TemporaryDirectory folder_;
};

TEST_F(TrackdOperation, StatusTellsOfARunningDaemonT14) {
  const auto daemon = start({"--simulate", "tour", "--log-level", "off"});
  {
    net::SyncClient client = subscribe();
    follow_cameras(client, 5);
  }
  std::string said;
  run({"status", "--json"}, &said);
  const nlohmann::json status = nlohmann::json::parse(said, nullptr, false);
  ASSERT_TRUE(status.is_object()) << said;
  std::set<std::string> devices;
  for (const auto& device : status["devices"]) devices.insert(device["device"]);
  EXPECT_TRUE(devices.contains("camera/left") && devices.contains("glove")) << said;
  EXPECT_EQ(run({"status"}, &said) & ~1, 0) << "0, or 1 with an alarm, as on a slow machine";
  EXPECT_NE(said.find("camera/left"), std::string::npos) << said;
}

TEST_F(TrackdOperation, StatusWithoutADaemonSaysSo) {
  EXPECT_EQ(run({"status"}), 1);
}

TEST_F(TrackdOperation, LatencyIsPublishedAboutOnceASecondT15) {
  const auto daemon = start({"--simulate", "tour", "--log-level", "off"});
  net::SyncClient client = subscribe();
  v1::LatencyFigures latency;
  for (int i = 0; i < 2000 && latency.frames() < 30; ++i) {
    const v1::TrackingFrame frame = next_frame(client);
    if (HasFailure()) return;
    EXPECT_EQ(frame.has_latency(), frame.fingertip_colours_size() > 0) << "with the devices";
    if (frame.has_latency()) latency = frame.latency();
  }
  EXPECT_GE(latency.frames(), 30u);
  EXPECT_GT(latency.p50_ms(), 0.0);
  EXPECT_LE(latency.p50_ms(), latency.p95_ms());
  EXPECT_LE(latency.p95_ms(), latency.p99_ms());
}

TEST_F(TrackdOperation, DoctorFindsWhatIsMissing) {
  std::string said;
  EXPECT_EQ(run({"doctor", "--json", "--calibration", file("none.toml").string()}, &said), 1);
  const nlohmann::json findings = nlohmann::json::parse(said, nullptr, false);
  ASSERT_TRUE(findings.is_array()) << said;
  EXPECT_EQ(findings[0]["subject"], "calibration");
  EXPECT_EQ(findings[0]["level"], "fail");
  for (const auto& finding : findings)
    EXPECT_EQ(finding["level"] == "ok", finding["remedy"] == "") << finding << ": a fault has a remedy";
}

TEST_F(TrackdOperation, DevicesAnswersInJson) {
  std::string said;
  EXPECT_EQ(run({"devices", "--json"}, &said), 0);
  EXPECT_TRUE(nlohmann::json::parse(said, nullptr, false).is_object()) << said;
}

TEST_F(TrackdOperation, WithoutCamerasItWaitsForGlovesPensAndMice) {
  const auto daemon = start({"--no-cameras", "--log-level", "off"});
  net::SyncClient client = subscribe();
  EXPECT_EQ(next_frame(client).cameras_size(), 0) << "alive all the same";
  daemon->signal(SIGTERM);
  EXPECT_EQ(daemon->wait(patience), std::optional<int>(0)) << daemon->error_output();
}

TEST_F(TrackdOperation, MetricsAreServedOverHttp) {
  const std::string metrics = file("metrics.sock").string();
  const auto daemon = start({"--simulate", "tour", "--log-level", "off", "--metrics", "unix:" + metrics});
  net::SyncClient client = subscribe();
  follow_cameras(client, 5);
  const std::string answer = http_get(metrics, "GET /metrics HTTP/1.1\r\nHost: x\r\n\r\n");
  EXPECT_TRUE(answer.starts_with("HTTP/1.1 200 OK\r\n")) << answer.substr(0, 200);
  EXPECT_NE(answer.find("text/plain; version=0.0.4"), std::string::npos);
  EXPECT_NE(answer.find("handloft_device_present{device=\"camera/left\"} 1"), std::string::npos) << answer;
  EXPECT_NE(answer.find("handloft_subscribers 1"), std::string::npos);
  EXPECT_TRUE(http_get(metrics, "GET /etc/passwd HTTP/1.1\r\n\r\n").starts_with("HTTP/1.1 404"));
  EXPECT_TRUE(http_get(metrics, "POST /metrics HTTP/1.1\r\n\r\n").starts_with("HTTP/1.1 405"));
  // Nonsense and endless requests are closed, and the daemon tracks on.
  EXPECT_FALSE(http_get(metrics, "\x16\x03\x01 nonsense\r\n\r\n").starts_with("HTTP/1.1 200"));
  EXPECT_FALSE(http_get(metrics, "GET /metrics HTTP/1.1\r\nX: " + std::string(20000, 'x'))
                   .starts_with("HTTP/1.1 200"));
  EXPECT_TRUE(http_get(metrics, "GET /metrics HTTP/1.0\r\n\r\n").find("200 OK") != std::string::npos);
  next_frame(client);
  struct stat status {};
  ASSERT_EQ(stat(metrics.c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777U, 0600U) << "T14";
}

TEST_F(TrackdOperation, MetricsStayOnThisComputer) {
  const auto daemon = start({"--simulate", "tour", "--metrics", "tcp:0.0.0.0:0"});
  EXPECT_EQ(daemon->wait(patience), std::optional<int>(1));
  EXPECT_NE(daemon->error_output().find("loopback"), std::string::npos) << daemon->error_output();
}

TEST_F(TrackdOperation, TheTraceHasEveryStageOfAFrame) {
  const auto trace = file("trace.json");
  const auto daemon = start({"--simulate", "tour", "--log-level", "off", "--trace", trace.string()});
  {
    net::SyncClient client = subscribe();
    follow_cameras(client, 20);
  }
  daemon->signal(SIGINT);
  ASSERT_EQ(daemon->wait(patience), std::optional<int>(0)) << daemon->error_output();
  std::ifstream in(trace);
  const nlohmann::json document = nlohmann::json::parse(in, nullptr, false);
  ASSERT_TRUE(document.is_object());
  std::map<std::string, int> spans;
  for (const auto& event : document["traceEvents"]) {
    if (event["ph"] != "X") continue;
    ++spans[event["name"]];
    EXPECT_GE(event["dur"], 0.0);
  }
  for (const char* stage : {"capture", "waiting", "decode", "tags", "fingertips", "fusion", "publish"})
    EXPECT_GT(spans[stage], 10) << stage;
}

TEST_F(TrackdOperation, HangUpReadsTheFilesAgainWithoutLosingSubscribers) {
  const auto config = file("trackd.toml");
  std::ofstream(config) << "simulate = \"tour\"\nseed = 1\n";
  const auto daemon = start({"--config", config.string()});
  net::SyncClient client = subscribe(v1::Subscribe::EVERY);
  std::uint64_t sequence = 0;
  const auto follow = [&](int frames) {
    for (int i = 0; i < frames && !HasFailure(); ++i) {
      const v1::TrackingFrame frame = next_frame(client);
      if (sequence != 0) {
        EXPECT_EQ(frame.sequence(), sequence + 1) << "no gap";
      }
      EXPECT_FALSE(frame.end_of_recording());
      sequence = frame.sequence();
    }
  };
  const auto follow_until_said = [&](const std::string& words) {
    for (int i = 0; i < 100 && daemon->error_output().find(words) == std::string::npos && !HasFailure(); ++i)
      follow(10);
    EXPECT_NE(daemon->error_output().find(words), std::string::npos) << daemon->error_output();
  };
  follow(20);
  std::ofstream(config) << "simulate = \"mouse\"\nseed = 2\n";
  daemon->signal(SIGHUP);
  follow_until_said("read again");
  std::ofstream(config) << "simulate = \"nonsense\"\n";
  daemon->signal(SIGHUP);
  follow_until_said("what was read before stays");
  EXPECT_NE(daemon->error_output().find("nonsense"), std::string::npos) << "the log names the mistake";
  follow(50);
  std::ofstream(config) << "simulate = \"mouse\"\nlisten = \"unix:/elsewhere\"\n";
  daemon->signal(SIGHUP);
  follow(50);
  daemon->signal(SIGTERM);
  EXPECT_EQ(daemon->wait(patience), std::optional<int>(0)) << daemon->error_output();
}

// What systemd does: the socket listens before the daemon runs, and is handed on as descriptor 3.
TEST_F(TrackdOperation, SocketActivationServesWhoConnectedBeforeItRan) {
  const std::string path = file("activated.sock").string();
  auto listener = net::listen_on(*net::parse_endpoint("unix:" + path));
  ASSERT_TRUE(listener.ok());
  const auto notify_path = file("notify.sock").string();
  const net::FileDescriptor notify(socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  notify_path.copy(address.sun_path, sizeof(address.sun_path) - 1);
  ASSERT_EQ(bind(notify.get(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)), 0);

  // The client connects first; the kernel keeps it waiting.
  const auto waiting = net::connect_to(listener->endpoint, 5000);
  ASSERT_TRUE(waiting.ok());

  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    dup2(listener->fd.get(), 3);
    fcntl(3, F_SETFD, 0);
    setenv("LISTEN_FDS", "1", 1);
    setenv("LISTEN_PID", std::to_string(getpid()).c_str(), 1);
    setenv("NOTIFY_SOCKET", notify_path.c_str(), 1);
    setenv("WATCHDOG_USEC", "300000", 1);
    setenv("WATCHDOG_PID", std::to_string(getpid()).c_str(), 1);
    const std::string program = test::program("handloft-trackd").string();
    execl(program.c_str(), program.c_str(), "--simulate", "tour", "--log-level", "off",
          static_cast<const char*>(nullptr));
    _exit(127);
  }
  std::string told;
  const auto told_within = [&](const std::string& words) {
    timeval limit{20, 0};
    setsockopt(notify.get(), SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof(limit));
    std::string message(4096, '\0');
    while (told.find(words) == std::string::npos) {
      const ssize_t size = recv(notify.get(), message.data(), message.size(), 0);
      if (size <= 0) return false;
      told += message.substr(0, static_cast<std::size_t>(size)) + "\n";
    }
    return true;
  };
  EXPECT_TRUE(told_within("READY=1")) << told;
  EXPECT_TRUE(told_within("WATCHDOG=1")) << told;
  net::ClientOptions options;
  options.role = v1::ROLE_SUBSCRIBER;
  {
    auto client = net::SyncClient::connect(listener->endpoint, options, clock_);
    ASSERT_TRUE(client.ok()) << client.error().describe();
    v1::Envelope subscribe;
    subscribe.mutable_subscribe();
    ASSERT_TRUE(client->send(subscribe).ok());
    next_frame(*client);
  }
  kill(child, SIGHUP);
  EXPECT_TRUE(told_within("RELOADING=1")) << told;
  kill(child, SIGTERM);
  EXPECT_TRUE(told_within("STOPPING=1")) << told;
  int status = 0;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_TRUE(WIFEXITED(status) && WEXITSTATUS(status) == 0);
  EXPECT_TRUE(std::filesystem::exists(path)) << "the socket is systemd's and stays";
}

TEST_F(TrackdOperation, AnotherUserIsRefusedT14) {
  if (geteuid() != 0) GTEST_SKIP() << "only root can be another user";
  const auto daemon = start({"--simulate", "tour", "--log-level", "off"});
  {
    net::SyncClient client = subscribe();
    next_frame(client);
  }
  struct stat status {};
  ASSERT_EQ(stat(file("t.sock").c_str(), &status), 0);
  EXPECT_EQ(status.st_mode & 0777U, 0600U);
  constexpr uid_t nobody = 65534;
  // Tries to subscribe as somebody else; 0: it got a frame.
  const auto try_as_nobody = [&] {
    const pid_t child = fork();
    if (child == 0) {
      if (setresuid(nobody, nobody, nobody) != 0) _exit(99);
      net::ClientOptions options;
      options.role = v1::ROLE_SUBSCRIBER;
      options.connect_timeout = std::chrono::milliseconds(500);
      auto client = net::SyncClient::connect(*net::parse_endpoint(endpoint()), options, clock_);
      _exit(client.ok() ? 0 : 1);
    }
    int result = 0;
    waitpid(child, &result, 0);
    return WIFEXITED(result) ? WEXITSTATUS(result) : -1;
  };
  EXPECT_EQ(try_as_nobody(), 1) << "the file's mode keeps others out";
  std::filesystem::permissions(folder_.path(), std::filesystem::perms::all);
  std::filesystem::permissions(file("t.sock"), std::filesystem::perms::all);
  EXPECT_EQ(try_as_nobody(), 1) << "and so do the peer's credentials where the mode does not";
  net::SyncClient client = subscribe();
  next_frame(client);
}

TEST_F(TrackdOperation, ARecordingOutlivesKillAtAnyMomentT13) {
  std::mt19937 random(13);
  std::uint64_t most = 0;
  for (int round = 0; round < 5; ++round) {
    const auto recording = file("killed-" + std::to_string(round) + ".rec");
    const auto daemon = start({"--simulate", "tour", "--pace", "fast", "--no-video", "--log-level", "off",
                               "--wait-for-subscribers", "1", "--record", recording.string()});
    {
      net::SyncClient client = subscribe(v1::Subscribe::EVERY);
      const int frames = std::uniform_int_distribution<int>(1, 60)(random);
      for (int i = 0; i < frames; ++i) next_frame(client);
      daemon->signal(SIGKILL);
    }
    ASSERT_EQ(daemon->wait(patience), std::optional<int>(128 + SIGKILL));
    std::filesystem::remove(file("t.sock"));
    most = std::max(most, read_recording(recording).first);
    // What is there replays, with the status of a recording that was cut off.
    EXPECT_EQ(run({"replay", recording.string(), "--exit-at-end", "--log-level", "off"}), 0);
  }
  EXPECT_GT(most, 10u) << "the writer's buffer reached the file before the end";
}

TEST_F(TrackdOperation, RecordTakesAFileAndReplayGivesItBackT13) {
  const auto recording = file("a.rec");
  {
    const auto daemon = start({"record", recording.string(), "--simulate", "tour", "--log-level", "off"});
    net::SyncClient client = subscribe();
    follow_cameras(client, 20);
    daemon->signal(SIGTERM);
    ASSERT_EQ(daemon->wait(patience), std::optional<int>(0)) << daemon->error_output();
  }
  const auto [records, end] = read_recording(recording);
  EXPECT_GT(records, 20u);
  EXPECT_EQ(end, record::RecordingEnd::complete);
  EXPECT_EQ(run({"replay", recording.string(), "--exit-at-end", "--speed", "10", "--log-level", "off"}), 0);
}

// The short form of bench_trackd_soak: rounds of a recording, all devices unplugged between them.
TEST_F(TrackdOperation, MemoryStaysAsItIsOverManyRounds) {
#if defined(__SANITIZE_ADDRESS__)
  GTEST_SKIP() << "the address sanitizer keeps what was freed";
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
  GTEST_SKIP() << "sanitizers keep what was freed";
#endif
#endif
  const auto recording = file("a.rec");
  {
    const auto daemon = start({"record", recording.string(), "--simulate", "tour", "--pace", "fast",
                               "--no-video", "--log-level", "off", "--wait-for-subscribers", "1"});
    net::SyncClient client = subscribe(v1::Subscribe::EVERY);
    for (int i = 0; i < 90; ++i) next_frame(client);
    { const net::SyncClient gone = std::move(client); }
    daemon->signal(SIGTERM);
    ASSERT_EQ(daemon->wait(patience), std::optional<int>(0)) << daemon->error_output();
  }
  const auto daemon = start({"replay", recording.string(), "--repeat", "1000", "--log-level", "off",
                             "--no-video", "--wait-for-subscribers", "1"});
  const auto resident_pages = [&] {
    std::ifstream in("/proc/" + std::to_string(daemon->pid()) + "/statm");
    std::uint64_t all = 0, resident = 0;
    in >> all >> resident;
    return resident;
  };
  net::SyncClient client = subscribe(v1::Subscribe::EVERY);
  constexpr int warm_up = 900, measured = 1800;  // A minute of three cameras is 5,400.
  for (int i = 0; i < warm_up && !HasFailure(); ++i) next_frame(client);
  const std::uint64_t before = resident_pages();
  for (int i = 0; i < measured && !HasFailure(); ++i) next_frame(client);
  const std::uint64_t after = resident_pages();
  EXPECT_GT(before, 0u);
  EXPECT_LT(static_cast<double>(after) - static_cast<double>(before), 4.0 * (1 << 20) / 4096.0)
      << before << " pages became " << after;
}

// systemd judges the unit as it is installed; the requirement is 4 at most for the daemon, which needs
// devices.
TEST(SystemdUnit, ItsExposureIsLow) {
  const std::string unit = HANDLOFT_TRACKD_UNIT;
  test::TemporaryDirectory folder;
  if (!std::filesystem::exists("/usr/bin/systemd-analyze"))
    GTEST_SKIP() << "systemd-analyze is not installed";
  test::Process analyze(
      {"/usr/bin/systemd-analyze", "security", "--offline=yes", "--no-pager", "--threshold=40", unit},
      folder.path() / "errors.txt");
  const std::string said = analyze.read_all(patience);
  EXPECT_EQ(analyze.wait(patience), std::optional<int>(0)) << said << analyze.error_output();
  EXPECT_NE(said.find("Overall exposure level"), std::string::npos) << said;
  const std::string summary = said.substr(std::min(said.size(), said.find("Overall exposure level")));
  testing::Test::RecordProperty("exposure", summary);
}

TEST(SystemdUnit, UnitAndSocketAreWellFormed) {
  if (!std::filesystem::exists("/usr/bin/systemd-analyze"))
    GTEST_SKIP() << "systemd-analyze is not installed";
  test::TemporaryDirectory folder;
  const std::filesystem::path socket = HANDLOFT_TRACKD_SOCKET;
  std::filesystem::copy_file(socket, folder.path() / socket.filename());
  // The program of the build stands in for the installed one, whose folder may not exist here.
  std::ifstream in(HANDLOFT_TRACKD_UNIT);
  std::string unit((std::istreambuf_iterator<char>(in)), {});
  const std::size_t begin = unit.find("ExecStart=") + 10;
  unit.replace(begin, unit.find(' ', begin) - begin, test::program("handloft-trackd").string());
  std::ofstream(folder.path() / "handloft-trackd.service") << unit;
  test::Process verify(
      {"/usr/bin/systemd-analyze", "verify", "--man=no", "--recursive-errors=no",
       (folder.path() / "handloft-trackd.service").string(), (folder.path() / socket.filename()).string()},
      folder.path() / "errors.txt");
  const int status = verify.wait(patience).value_or(-1);
  EXPECT_EQ(status, 0) << verify.error_output();
  EXPECT_EQ(verify.error_output().find("handloft"), std::string::npos) << verify.error_output();
}

// The rules and the daemon must mean the same devices.
TEST(UdevRules, NameTheGloveAndEvery3DMouseByCable) {
  std::ifstream in(HANDLOFT_UDEV_RULES);
  std::vector<std::string> rules;
  for (std::string line; std::getline(in, line);)
    if (line.starts_with("SUBSYSTEM==")) rules.push_back(line);
  ASSERT_GE(rules.size(), 6u);
  // udev's patterns are those of fnmatch, with | between alternatives.
  const auto value_of = [](const std::string& rule, const std::string& key) {
    const std::size_t at = rule.find(key + "==\"");
    if (at == std::string::npos) return std::string("*");
    const std::size_t begin = at + key.size() + 3;
    return rule.substr(begin, rule.find('"', begin) - begin);
  };
  const auto matches = [](const std::string& patterns, const std::string& text) {
    for (std::size_t begin = 0; begin <= patterns.size();) {
      const std::size_t end = std::min(patterns.find('|', begin), patterns.size());
      if (fnmatch(patterns.substr(begin, end - begin).c_str(), text.c_str(), 0) == 0) return true;
      begin = end + 1;
    }
    return false;
  };
  const auto granted = [&](std::uint16_t vendor, std::uint16_t product) {
    return std::any_of(rules.begin(), rules.end(), [&](const std::string& rule) {
      return rule.find("SUBSYSTEM==\"hidraw\"") == 0 && rule.find("TAG+=\"uaccess\"") != std::string::npos &&
             matches(value_of(rule, "ATTRS{idVendor}"), fmt::format("{:04x}", vendor)) &&
             matches(value_of(rule, "ATTRS{idProduct}"), fmt::format("{:04x}", product));
    });
  };
  EXPECT_TRUE(granted(glove_usb_vendor, glove_usb_product));
  int mice = 0;
  for (const std::uint16_t vendor : {std::uint16_t{0x046D}, std::uint16_t{0x256F}}) {
    for (unsigned product = 0; product <= 0xFFFF; ++product) {
      if (!is_known_space_mouse(vendor, static_cast<std::uint16_t>(product))) continue;
      ++mice;
      EXPECT_TRUE(granted(vendor, static_cast<std::uint16_t>(product)))
          << std::hex << vendor << ':' << product;
    }
  }
  EXPECT_GT(mice, 10);
  EXPECT_FALSE(granted(0x046D, 0xC31C)) << "a keyboard";
}

}  // namespace
}  // namespace handloft::tracking

// Who watches a server with several models: which of them hangs, which cannot be kept, and when systemd is
// told that all live (issue 7, part 6).

#include "server-model/session/serve_watch.h"

#include <gmock/gmock.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <boost/asio/io_context.hpp>
#include <cstdlib>
#include <map>

#include "tests/support/test_data.h"

namespace handloft::session {
namespace {

using namespace std::chrono_literals;
using ::testing::HasSubstr;

/// A model whose thread answers when the test lets it.
struct FakeModel {
  bool hangs = false;
  std::function<void()> waiting;
  Status kept;
};

class ServeWatchTest : public ::testing::Test {
 protected:
  void SetUp() override {
    // systemd's end.
    path_ = (folder_.path() / "notify.sock").string();
    socket_ = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK, 0);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path_.copy(address.sun_path, sizeof(address.sun_path) - 1);
    ASSERT_EQ(::bind(socket_, reinterpret_cast<const sockaddr*>(&address), sizeof(address)), 0);
    ::setenv("NOTIFY_SOCKET", path_.c_str(), 1);
    ::setenv("WATCHDOG_USEC", "60000000", 1);
    ::setenv("WATCHDOG_PID", std::to_string(::getpid()).c_str(), 1);
    clock_.set(from_ns(1'000'000'000'000));
    service_ = std::make_unique<net::ServiceManager>(clock_);
    for (const char* name : {"main", "seat", "mouse"}) models_[name] = std::make_shared<FakeModel>();
    WatchHooks hooks;
    hooks.models = [this] {
      std::vector<WatchedModel> watched;
      for (const auto& [name, model] : models_) {
        WatchedModel one;
        one.name = name;
        one.held = model;
        one.ask = [weak = std::weak_ptr(model)](std::function<void()> answered) {
          const auto asked = weak.lock();
          if (!asked) return;
          if (asked->hangs) {
            asked->waiting = std::move(answered);
          } else {
            answered();
          }
        };
        one.kept = [weak = std::weak_ptr(model)] {
          const auto asked = weak.lock();
          return asked ? asked->kept : Status();
        };
        watched.push_back(std::move(one));
      }
      return watched;
    };
    hooks.figures = [] { return PresentFigures{}; };
    auto watch = ServeWatch::start(context_.get_executor(), "", std::make_shared<SessionMetrics>(), *service_,
                                   std::move(hooks), clock_, Logger("test", LogLevel::off));
    ASSERT_TRUE(watch.ok());
    watch_ = *std::move(watch);
  }
  void TearDown() override {
    watch_.reset();
    ::close(socket_);
    ::unsetenv("NOTIFY_SOCKET");
  }
  void pass(std::chrono::seconds time) {
    for (auto passed = 0s; passed < time; ++passed) {
      clock_.advance(1s);
      watch_->look();
    }
  }
  /// What systemd was told since the last call.
  int signs_of_life() {
    int count = 0;
    std::array<char, 256> text{};
    while (::recv(socket_, text.data(), text.size(), 0) > 0) ++count;
    return count;
  }

  test::TemporaryDirectory folder_;
  std::string path_;
  int socket_ = -1;
  ManualClock clock_;
  boost::asio::io_context context_;
  std::unique_ptr<net::ServiceManager> service_;
  std::map<std::string, std::shared_ptr<FakeModel>> models_;
  std::unique_ptr<ServeWatch> watch_;
};

TEST_F(ServeWatchTest, AModelThatHangsIsNamedAndSystemdHearsNothingMore) {
  pass(120s);
  EXPECT_TRUE(watch_->alive().ok());
  EXPECT_TRUE(watch_->ready().ok());
  EXPECT_GE(signs_of_life(), 4);
  models_["seat"]->hangs = true;  // Not the first one.
  pass(2s);
  (void)signs_of_life();
  EXPECT_TRUE(watch_->alive().ok()) << "an operation may take some seconds";
  pass(40s);
  EXPECT_THAT(watch_->alive().error().message, HasSubstr("\"seat\" has not answered for 4"));
  EXPECT_EQ(watch_->alive().error().field, "model");
  EXPECT_THAT(watch_->ready().error().message, HasSubstr("\"seat\""));
  pass(60s);
  EXPECT_EQ(signs_of_life(), 0) << "the others' answers do not hide it";
  models_["mouse"]->hangs = true;
  pass(40s);
  EXPECT_THAT(watch_->alive().error().message, HasSubstr("and 1 more"));
  for (const char* name : {"seat", "mouse"}) {
    models_[name]->hangs = false;
    models_[name]->waiting();
  }
  pass(60s);
  EXPECT_TRUE(watch_->alive().ok());
  EXPECT_GE(signs_of_life(), 1);
}

TEST_F(ServeWatchTest, AModelWhoseDiskIsFullIsNamed) {
  pass(1s);
  models_["mouse"]->kept = make_error(ErrorCode::resource_exhausted, "the disk is full", "store");
  EXPECT_TRUE(watch_->alive().ok());
  EXPECT_EQ(watch_->ready().error().message, "the model \"mouse\": the disk is full");
  EXPECT_EQ(watch_->ready().error().code, ErrorCode::resource_exhausted);
  models_["mouse"]->kept = {};
  EXPECT_TRUE(watch_->ready().ok());
}

TEST_F(ServeWatchTest, AModelThatIsClosedIsForgottenAndOneThatHangsInClosingIsNot) {
  pass(1s);
  models_["seat"]->hangs = models_["mouse"]->hangs = true;
  pass(1s);
  const auto closing = models_["mouse"];
  models_.erase("seat");   // Closed, to its end.
  models_.erase("mouse");  // No longer among those that are served, and not closed.
  pass(60s);
  EXPECT_THAT(watch_->alive().error().message, HasSubstr("\"mouse\""));
  EXPECT_THAT(watch_->alive().error().message, ::testing::Not(HasSubstr("more")));
  models_["late"] = std::make_shared<FakeModel>();
  pass(1s);
  closing->waiting();
  EXPECT_TRUE(watch_->alive().ok());
}

}  // namespace
}  // namespace handloft::session

#include "tests/support/bad_link.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <stdexcept>
#include <string>
#include <utility>

namespace handloft::test {
namespace {

constexpr int longest_connect_ms = 1000;

[[noreturn]] void give_up(const char* what) {
  throw std::runtime_error(std::string("bad link: ") + what + ": " + std::strerror(errno));
}

sockaddr_un address_of(const std::string& path) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  if (path.size() >= sizeof(address.sun_path)) throw std::runtime_error("bad link: the path is too long");
  std::copy(path.begin(), path.end(), address.sun_path);
  return address;
}

void do_not_block(int fd) {
  ::fcntl(fd, F_SETFL, ::fcntl(fd, F_GETFL, 0) | O_NONBLOCK);
}

bool goes_to_server(BadLink::Fault fault) {
  return fault == BadLink::Fault::none || fault == BadLink::Fault::stalled_to_client;
}
bool goes_to_client(BadLink::Fault fault) {
  return fault == BadLink::Fault::none || fault == BadLink::Fault::stalled_to_server;
}

}  // namespace

BadLink::BadLink(const std::filesystem::path& path, net::Endpoint server) : server_(std::move(server)) {
  endpoint_.path = path.string();
  listener_ = net::FileDescriptor(::socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
  const sockaddr_un address = address_of(endpoint_.path);
  if (::bind(listener_.get(), reinterpret_cast<const sockaddr*>(&address), sizeof(address)) != 0)
    give_up("bind");
  if (::listen(listener_.get(), 16) != 0) give_up("listen");
  wake_ = net::FileDescriptor(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK));
  if (!wake_.valid()) give_up("eventfd");
  thread_ = std::thread([this] { run(); });
}

BadLink::~BadLink() {
  stopped_ = true;
  suffer(Fault::cut);
  thread_.join();
}

void BadLink::suffer(Fault fault) {
  fault_ = fault;
  const std::uint64_t one = 1;
  (void)!::write(wake_.get(), &one, sizeof(one));
}

void BadLink::accept(Fault fault) {
  net::FileDescriptor client(::accept4(listener_.get(), nullptr, nullptr, SOCK_CLOEXEC));
  if (!client.valid() || fault == Fault::cut) return;
  auto server = net::connect_to(server_, longest_connect_ms);
  if (!server) return;
  do_not_block(client.get());
  do_not_block(server->get());
  Pair& pair = pairs_.emplace_back();
  pair.client = std::move(client);
  pair.server = *std::move(server);
  ++connections_;
}

bool BadLink::swallow(int from, Direction& direction) {
  std::array<char, 16384> bytes{};
  bool any = false;
  while (!direction.ended) {
    const ssize_t got = ::recv(from, bytes.data(), bytes.size(), 0);
    if (got < 0) break;
    direction.ended = got == 0;
    any = true;
  }
  return any;
}

bool BadLink::move(int from, int to, Direction& direction) {
  std::array<char, 16384> bytes{};
  while (true) {
    while (!direction.waiting.empty()) {
      const ssize_t sent = ::send(to, direction.waiting.data(), direction.waiting.size(), MSG_NOSIGNAL);
      if (sent < 0) return errno == EAGAIN || errno == EINTR;
      direction.waiting.erase(direction.waiting.begin(), direction.waiting.begin() + sent);
    }
    if (direction.ended) return false;
    const ssize_t got = ::recv(from, bytes.data(), bytes.size(), 0);
    if (got < 0) return errno == EAGAIN || errno == EINTR;
    direction.ended = got == 0;
    direction.waiting.insert(direction.waiting.end(), bytes.begin(), bytes.begin() + got);
  }
}

void BadLink::carry(Pair& pair, Fault fault) {
  // What is lost in the middle of a stream cannot be made good.
  if (fault == Fault::cut || (pair.lost_bytes && fault != Fault::swallowed)) {
    pair.over = true;
    return;
  }
  if (fault == Fault::swallowed) {
    const bool from_client = swallow(pair.client.get(), pair.to_server);
    const bool from_server = swallow(pair.server.get(), pair.to_client);
    pair.lost_bytes = pair.lost_bytes || from_client || from_server;
    return;
  }
  if (goes_to_server(fault) && !move(pair.client.get(), pair.server.get(), pair.to_server)) pair.over = true;
  if (goes_to_client(fault) && !move(pair.server.get(), pair.client.get(), pair.to_client)) pair.over = true;
}

void BadLink::run() {
  std::vector<pollfd> watched;
  while (!stopped_) {
    const Fault fault = fault_;
    for (Pair& pair : pairs_) carry(pair, fault);
    std::erase_if(pairs_, [](const Pair& pair) { return pair.over; });
    watched = {{wake_.get(), POLLIN, 0}, {listener_.get(), POLLIN, 0}};
    const auto watch = [&](int from, int to, const Direction& direction) {
      if (direction.waiting.empty() && !direction.ended) {
        watched.push_back({from, POLLIN, 0});
      } else if (!direction.waiting.empty()) {
        watched.push_back({to, POLLOUT, 0});
      }
    };
    for (const Pair& pair : pairs_) {
      if (fault == Fault::swallowed || goes_to_server(fault))
        watch(pair.client.get(), pair.server.get(), pair.to_server);
      if (fault == Fault::swallowed || goes_to_client(fault))
        watch(pair.server.get(), pair.client.get(), pair.to_client);
    }
    ::poll(watched.data(), watched.size(), -1);
    std::uint64_t count = 0;
    (void)!::read(wake_.get(), &count, sizeof(count));
    if ((watched[1].revents & POLLIN) != 0) accept(fault_);
  }
}

}  // namespace handloft::test

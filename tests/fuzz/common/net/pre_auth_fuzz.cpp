// All that a stranger can say before the server knows who it is (A1): any bytes, as they come from the
// socket, through the server's own connection to the decision. Nobody without a certificate comes in, nothing
// is answered but one Failure or Paired, and what is held of them is bounded.

#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <boost/asio/io_context.hpp>
#include <cstdlib>
#include <ctime>
#include <memory>

#include "common/net/byte_stream.h"
#include "common/net/certificates.h"
#include "common/net/pairing_code.h"
#include "common/net/server_connection.h"

namespace {

using namespace handloft;
using namespace handloft::net;

constexpr std::int64_t day_s = 86'400;

const CertificateAuthority& authority() {
  static const CertificateAuthority made =
      *CertificateAuthority::create("fuzz", {std::time(nullptr) - day_s, std::time(nullptr) + day_s});
  return made;
}

Result<v1::Paired> decide(const v1::Pair& pair) {
  const auto code = read_pairing_code(pair.code());
  if (!code) return code.error();
  const auto again = read_pairing_code(write_pairing_code(*code));
  if (!again || !(*again == *code)) std::abort();
  const auto certificate = authority().issue_client(pair.certificate_request(), "Ann",
                                                    {std::time(nullptr), std::time(nullptr) + day_s});
  if (!certificate) return certificate.error();
  if (!read_certificate(*certificate)) std::abort();
  v1::Paired paired;
  paired.set_certificate(*certificate);
  return paired;
}

/// All answers; aborts on what no stranger may get.
void check_answers(int fd) {
  FrameDecoder decoder;
  for (;;) {
    const auto room = decoder.prepare();
    const ssize_t count = ::recv(fd, room.data(), room.size(), MSG_DONTWAIT);
    if (count <= 0) break;
    decoder.commit(static_cast<std::size_t>(count));
  }
  int answers = 0;
  v1::Envelope envelope;
  for (;;) {
    const auto payload = decoder.next();
    if (!payload || !*payload) break;
    if (!parse_envelope(**payload, envelope)) std::abort();
    if (!envelope.has_failure() && !envelope.has_paired()) std::abort();
    ++answers;
  }
  if (answers > 1 || decoder.mid_frame()) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  // The first byte says how the bytes arrive and whether the peer stays.
  if (size == 0) return 0;
  const std::size_t piece = 1 + (data[0] & 0x3FU) * 97;
  const bool stays = (data[0] & 0x40U) != 0;
  ++data;
  --size;
  constexpr std::size_t most = 64 << 10;
  if (size > most) return 0;

  static const SystemClock clock;
  boost::asio::io_context context;
  auto shared =
      std::make_shared<ServerShared>(ServerShared{{}, {}, &clock, Logger("fuzz", LogLevel::off), {}, {}});
  shared->on_over = [](std::uint64_t) {};
  shared->on_joined = [](std::uint64_t) { std::abort(); };
  shared->events.admit = [](const PeerInfo& peer) -> Result<Admission> {
    if (peer.certificate) std::abort();
    return make_error(ErrorCode::permission_denied, "this device is not paired with this server");
  };
  shared->events.on_pair = [](const PairingRequest& request, const PairingAnswer& answer) {
    answer(decide(request.pair));
  };
  shared->events.on_join = [](const ConnectionPtr&) -> Status { std::abort(); };
  shared->events.on_message = [](const ConnectionPtr&, const v1::Envelope&) -> Status { std::abort(); };

  int ends[2];
  if (socketpair(AF_UNIX, SOCK_STREAM | SOCK_NONBLOCK, 0, ends) != 0) std::abort();
  ConnectionOrigin origin;
  origin.number = 1;
  origin.address = "192.0.2.7";
  origin.channel = ConnectionOrigin::Channel::tls;
  auto stream = make_plain_stream(ends[0]);
  auto connection = std::make_shared<ServerConnection>(context.get_executor(), FileDescriptor(ends[0]),
                                                       std::move(stream), std::move(origin), shared);
  connection->start();
  while (size > 0) {
    const ssize_t count = ::send(ends[1], data, std::min(size, piece), MSG_NOSIGNAL | MSG_DONTWAIT);
    if (count <= 0) break;  // Refused already, or more than the kernel keeps of what is not read.
    data += count;
    size -= static_cast<std::size_t>(count);
    context.poll();
    context.restart();
  }
  context.poll();
  context.restart();
  check_answers(ends[1]);
  if (!stays) ::shutdown(ends[1], SHUT_WR);
  connection->close();
  context.poll();
  context.restart();
  ::close(ends[1]);
  context.poll();
  connection.reset();
  return 0;
}

#include "common/net/tls.h"

#include <fmt/format.h>
#include <openssl/pem.h>
#include <openssl/x509v3.h>
#include <sys/socket.h>

#include <algorithm>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <mutex>

#include "common/net/openssl_handles.h"

namespace handloft::net {

namespace {

constexpr std::size_t shortest_fingerprint = 32;  // 128 bits.

enum class Side { server, client };

// OpenSSL's own socket BIO writes without MSG_NOSIGNAL: a peer that went away would end the program.

int socket_of(BIO* bio) {
  return static_cast<int>(reinterpret_cast<std::intptr_t>(BIO_get_data(bio)));
}

int moved_or_retry(BIO* bio, ssize_t count, int retry_flag) {
  BIO_clear_retry_flags(bio);
  if (count < 0 && (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR))
    BIO_set_flags(bio, retry_flag | BIO_FLAGS_SHOULD_RETRY);
  return static_cast<int>(count);
}

int write_socket(BIO* bio, const char* bytes, int count) {
  return moved_or_retry(
      bio, ::send(socket_of(bio), bytes, static_cast<std::size_t>(count), MSG_DONTWAIT | MSG_NOSIGNAL),
      BIO_FLAGS_WRITE);
}

int read_socket(BIO* bio, char* bytes, int count) {
  const ssize_t got = ::recv(socket_of(bio), bytes, static_cast<std::size_t>(count), MSG_DONTWAIT);
  if (got == 0) BIO_set_flags(bio, BIO_FLAGS_IN_EOF);
  return moved_or_retry(bio, got, BIO_FLAGS_READ);
}

long control_socket(BIO* bio, int command, long, void*) {
  if (command == BIO_CTRL_FLUSH || command == BIO_CTRL_DUP) return 1;
  if (command == BIO_CTRL_EOF) return BIO_test_flags(bio, BIO_FLAGS_IN_EOF) != 0 ? 1 : 0;
  return 0;
}

const BIO_METHOD* quiet_socket() {
  static const std::unique_ptr<BIO_METHOD, OpensslDeleter<& BIO_meth_free>> method = [] {
    BIO_METHOD* made = BIO_meth_new(BIO_TYPE_SOURCE_SINK | BIO_get_new_index(), "socket without signals");
    if (made != nullptr) {
      BIO_meth_set_write(made, write_socket);
      BIO_meth_set_read(made, read_socket);
      BIO_meth_set_ctrl(made, control_socket);
    }
    return std::unique_ptr<BIO_METHOD, OpensslDeleter<&BIO_meth_free>>(made);
  }();
  return method.get();
}

Error corrupt(std::string message, std::string field) {
  return make_error(ErrorCode::data_corrupt, std::move(message), std::move(field));
}

Status use_identity(SSL_CTX* context, const TlsIdentity& identity) {
  const CertificateHandle certificate = certificate_of(identity.certificate_pem);
  if (!certificate) return corrupt("found no certificate in PEM", "tls.certificate");
  const KeyHandle key = key_of(identity.key_pem);
  if (!key) return corrupt("found no private key in PEM", "tls.key");
  const bool fits = SSL_CTX_use_certificate(context, certificate.get()) == 1 &&
                    SSL_CTX_use_PrivateKey(context, key.get()) == 1 &&
                    SSL_CTX_check_private_key(context) == 1;
  ERR_clear_error();
  if (!fits) return corrupt("the key is not the certificate's", "tls.key");
  return {};
}

/// Trusts that authority alone, and sends its certificate along: a client that is being paired has never seen
/// it.
Status use_authority(SSL_CTX* context, const std::string& pem, Side side) {
  const CertificateHandle authority = certificate_of(pem);
  if (!authority) return corrupt("found no certificate in PEM", "tls.authority");
  bool good = X509_STORE_add_cert(SSL_CTX_get_cert_store(context), authority.get()) == 1;
  if (side == Side::server) {
    good = good && SSL_CTX_add1_chain_cert(context, authority.get()) == 1 &&
           SSL_CTX_add_client_CA(context, authority.get()) == 1;
  }
  if (!good) return openssl_error("trusting an authority");
  return {};
}

/// The stack alone, not what it points to.
void free_stack(STACK_OF(X509) * held) {
  sk_X509_free(held);
}

struct Pin {
  std::string fingerprint;
};

/// The chain that a server shows is believed when it ends in the authority with the pinned fingerprint;
/// OpenSSL then checks signatures, times, purpose and name against it as always.
int trust_pinned(X509_STORE_CTX* chain, void* argument) {
  const auto* pin = static_cast<const Pin*>(argument);
  STACK_OF(X509)* shown = X509_STORE_CTX_get0_untrusted(chain);
  const std::unique_ptr<STACK_OF(X509), OpensslDeleter<&free_stack>> trusted(sk_X509_new_null());
  for (int i = 0; trusted && i < sk_X509_num(shown); ++i) {
    X509* each = sk_X509_value(shown, i);
    if (fingerprint_of(each).starts_with(pin->fingerprint) && X509_check_ca(each) == 1)
      sk_X509_push(trusted.get(), each);
  }
  if (!trusted || sk_X509_num(trusted.get()) == 0) {
    X509_STORE_CTX_set_error(chain, X509_V_ERR_SELF_SIGNED_CERT_IN_CHAIN);
    return 0;
  }
  X509_STORE_CTX_set0_trusted_stack(chain, trusted.get());
  return X509_verify_cert(chain);
}

class TlsStream final : public ByteStream {
 public:
  TlsStream(SessionHandle session, int fd) : session_(std::move(session)), fd_(fd) {}

  StreamOutcome read(std::span<std::uint8_t> room) override {
    const std::lock_guard lock(mutex_);
    std::size_t count = 0;
    ERR_clear_error();
    const int result = SSL_read_ex(session_.get(), room.data(), room.size(), &count);
    return outcome(result, count);
  }
  StreamOutcome write(std::span<const std::uint8_t> bytes) override {
    const std::lock_guard lock(mutex_);
    std::size_t count = 0;
    ERR_clear_error();
    const int result = SSL_write_ex(session_.get(), bytes.data(), bytes.size(), &count);
    StreamOutcome written = outcome(result, count);
    // Within the handshake: what is to be written would never be.
    if (written.state == StreamOutcome::State::ended)
      written = {StreamOutcome::State::failed, 0, "the peer closed it"};
    return written;
  }
  void end_writing() override {
    const std::lock_guard lock(mutex_);
    ERR_clear_error();
    if (!broken_ && SSL_is_init_finished(session_.get()) == 1) SSL_shutdown(session_.get());
    ERR_clear_error();
    ::shutdown(fd_, SHUT_WR);
  }
  bool has_unread() const override {
    const std::lock_guard lock(mutex_);
    return SSL_has_pending(session_.get()) == 1;
  }
  std::optional<CertificateFacts> peer() const override {
    const std::lock_guard lock(mutex_);
    if (SSL_is_init_finished(session_.get()) != 1) return std::nullopt;
    const X509* certificate = SSL_get0_peer_certificate(session_.get());
    if (certificate == nullptr || SSL_get_verify_result(session_.get()) != X509_V_OK) return std::nullopt;
    const Result<std::string> pem = written(certificate);
    const Result<CertificateFacts> facts = pem ? read_certificate(*pem) : pem.error();
    return facts ? std::optional(*facts) : std::nullopt;
  }
  std::string authority() const {
    const std::lock_guard lock(mutex_);
    STACK_OF(X509)* chain = SSL_get0_verified_chain(session_.get());
    if (SSL_is_init_finished(session_.get()) != 1 || chain == nullptr || sk_X509_num(chain) == 0) return {};
    const Result<std::string> pem = written(sk_X509_value(chain, sk_X509_num(chain) - 1));
    return pem ? *pem : std::string();
  }

 private:
  static Result<std::string> written(const X509* certificate) {
    const BioHandle bio(BIO_new(BIO_s_mem()));
    if (!bio || PEM_write_bio_X509(bio.get(), certificate) != 1)
      return openssl_error("writing a certificate");
    return text_of(bio.get());
  }
  StreamOutcome outcome(int result, std::size_t count) {
    if (result == 1) return {StreamOutcome::State::moved, count};
    switch (SSL_get_error(session_.get(), result)) {
      case SSL_ERROR_WANT_READ:
        return {StreamOutcome::State::wants_read};
      case SSL_ERROR_WANT_WRITE:
        return {StreamOutcome::State::wants_write};
      case SSL_ERROR_ZERO_RETURN:
        return {StreamOutcome::State::ended};
      case SSL_ERROR_SYSCALL:
        broken_ = true;
        return {StreamOutcome::State::failed, 0,
                errno != 0 ? std::strerror(errno) : "the peer went away without saying so"};
      default:
        break;
    }
    broken_ = true;
    const long verdict = SSL_get_verify_result(session_.get());
    if (verdict != X509_V_OK) {
      ERR_clear_error();
      return {StreamOutcome::State::failed, 0,
              fmt::format("the certificate is not believed: {}", X509_verify_cert_error_string(verdict))};
    }
    return {StreamOutcome::State::failed, 0, openssl_complaint()};
  }

  mutable std::mutex mutex_;
  SessionHandle session_;
  int fd_;
  bool broken_ = false;
};

}  // namespace

struct TlsContext::Implementation {
  Side side = Side::client;
  Pin pin;
  ContextHandle context;

  static Result<std::unique_ptr<Implementation>> create(Side side) {
    auto made = std::make_unique<Implementation>();
    made->side = side;
    made->context.reset(SSL_CTX_new(side == Side::server ? TLS_server_method() : TLS_client_method()));
    SSL_CTX* context = made->context.get();
    if (context == nullptr || SSL_CTX_set_min_proto_version(context, TLS1_3_VERSION) != 1 ||
        SSL_CTX_set_max_proto_version(context, TLS1_3_VERSION) != 1)
      return openssl_error("a context for TLS");
    SSL_CTX_set_mode(context, SSL_MODE_ENABLE_PARTIAL_WRITE | SSL_MODE_ACCEPT_MOVING_WRITE_BUFFER |
                                  SSL_MODE_RELEASE_BUFFERS);
    // Every connection proves anew who it is: a revoked certificate lives on in no ticket, and early data,
    // which could be played again, is off by default.
    SSL_CTX_set_session_cache_mode(context, SSL_SESS_CACHE_OFF);
    SSL_CTX_set_num_tickets(context, 0);
    // A program that ends without a word of TLS has closed, as it may: frames say how long they are, so that
    // one that was cut off is known (FrameDecoder::mid_frame()).
    SSL_CTX_set_options(context, SSL_OP_IGNORE_UNEXPECTED_EOF);
    return made;
  }
};

TlsContext::TlsContext(std::unique_ptr<Implementation> implementation)
    : implementation_(std::move(implementation)) {}
TlsContext::~TlsContext() = default;

Result<std::shared_ptr<const TlsContext>> TlsContext::for_server(const TlsIdentity& server,
                                                                 const std::string& authority_pem,
                                                                 TlsClients clients) {
  auto made = Implementation::create(Side::server);
  if (!made) return made.error();
  SSL_CTX* context = (*made)->context.get();
  if (const Status used = use_identity(context, server); !used) return used.error();
  if (const Status trusted = use_authority(context, authority_pem, Side::server); !trusted)
    return trusted.error();
  SSL_CTX_set_purpose(context, X509_PURPOSE_SSL_CLIENT);
  SSL_CTX_set_verify(context,
                     SSL_VERIFY_PEER | (clients == TlsClients::known ? SSL_VERIFY_FAIL_IF_NO_PEER_CERT : 0),
                     nullptr);
  return std::shared_ptr<const TlsContext>(new TlsContext(std::move(*made)));
}

Result<std::shared_ptr<const TlsContext>> TlsContext::for_client(const TlsIdentity& client,
                                                                 const std::string& authority_pem) {
  auto made = Implementation::create(Side::client);
  if (!made) return made.error();
  SSL_CTX* context = (*made)->context.get();
  if (const Status used = use_identity(context, client); !used) return used.error();
  if (const Status trusted = use_authority(context, authority_pem, Side::client); !trusted)
    return trusted.error();
  SSL_CTX_set_verify(context, SSL_VERIFY_PEER, nullptr);
  return std::shared_ptr<const TlsContext>(new TlsContext(std::move(*made)));
}

Result<std::shared_ptr<const TlsContext>> TlsContext::for_pairing(const std::string& authority_fingerprint) {
  const bool hexadecimal = authority_fingerprint.find_first_not_of("0123456789abcdef") == std::string::npos;
  if (!hexadecimal || authority_fingerprint.size() < shortest_fingerprint)
    return make_error(
        ErrorCode::invalid_argument,
        fmt::format("expected at least {} hexadecimal digits of a fingerprint", shortest_fingerprint),
        "fingerprint");
  auto made = Implementation::create(Side::client);
  if (!made) return made.error();
  (*made)->pin.fingerprint = authority_fingerprint;
  SSL_CTX* context = (*made)->context.get();
  SSL_CTX_set_verify(context, SSL_VERIFY_PEER, nullptr);
  SSL_CTX_set_cert_verify_callback(context, trust_pinned, &(*made)->pin);
  return std::shared_ptr<const TlsContext>(new TlsContext(std::move(*made)));
}

Result<std::unique_ptr<ByteStream>> TlsContext::open(int fd) const {
  SessionHandle session(SSL_new(implementation_->context.get()));
  BIO* socket = session && quiet_socket() != nullptr ? BIO_new(quiet_socket()) : nullptr;
  if (socket == nullptr) return openssl_error("a TLS connection");
  BIO_set_data(socket, reinterpret_cast<void*>(static_cast<std::intptr_t>(fd)));
  BIO_set_init(socket, 1);
  SSL_set_bio(session.get(), socket, socket);
  if (implementation_->side == Side::server) {
    SSL_set_accept_state(session.get());
  } else {
    SSL_set_connect_state(session.get());
    const std::string name(tls_server_name);
    SSL_set_hostflags(session.get(), X509_CHECK_FLAG_NO_WILDCARDS);
    if (SSL_set1_host(session.get(), name.c_str()) != 1) return openssl_error("a TLS connection");
  }
  return std::unique_ptr<ByteStream>(new TlsStream(std::move(session), fd));
}

std::string TlsContext::shown_authority(const ByteStream& stream) {
  const auto* tls = dynamic_cast<const TlsStream*>(&stream);
  return tls == nullptr ? std::string() : tls->authority();
}

}  // namespace handloft::net

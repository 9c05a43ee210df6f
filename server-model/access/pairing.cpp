// Invitations and what becomes of them: the part of AccessFile that is about codes.

#include <fmt/format.h>
#include <openssl/crypto.h>
#include <openssl/rand.h>
#include <openssl/sha.h>

#include <array>
#include <utility>

#include "common/net/pairing_code.h"
#include "server-model/access/access_file.h"
#include "server-model/access/names.h"

namespace handloft::access {

using Step = store::Statement::Step;

namespace {

constexpr Seconds minute_s = 60, day_s = 24 * 60 * 60;
constexpr Seconds longest_valid_s = 7 * day_s;
constexpr std::int64_t most_invitations = 1000;
// Of the 60 secret bits of a code 20 say which invitation it is, so that wrong ones can be counted against
// it, and 40 are kept as a salted hash only: with five attempts one in 2 * 10^11 guesses gets through.
constexpr int key_bits = 40;
constexpr std::uint64_t keys = std::uint64_t{1} << key_bits;
constexpr std::size_t salt_bytes = 16;

Result<std::uint64_t> random_bits() {
  std::uint64_t bits = 0;
  if (RAND_bytes(reinterpret_cast<unsigned char*>(&bits), sizeof(bits)) != 1)
    return make_error(ErrorCode::internal, "the system has no random numbers");
  return bits;
}

std::string hash_of(std::string_view salt, std::uint64_t secret) {
  std::string text(salt);
  for (int byte = 0; byte < 8; ++byte) text += static_cast<char>(secret >> (8 * byte));
  std::string digest(SHA256_DIGEST_LENGTH, '\0');
  SHA256(reinterpret_cast<const unsigned char*>(text.data()), text.size(),
         reinterpret_cast<unsigned char*>(digest.data()));
  return digest;
}

/// The same words whatever is wrong, so that they teach nothing.
Error wrong_code() {
  return make_error(ErrorCode::permission_denied, "the code is wrong, used or too old: ask for a new one",
                    "code");
}

}  // namespace

Result<std::string> AccessFile::invite(const Invite& invite, Seconds now_s) {
  if (auto good = check_name(invite.user, "name"); !good) return good.error();
  if (auto good = check_model(invite.model); !good) return good.error();
  if (rank(invite.role) == 0)
    return make_error(ErrorCode::invalid_argument, "expected viewer, commenter, editor or owner", "role");
  if (invite.valid_s < minute_s || invite.valid_s > longest_valid_s)
    return make_error(ErrorCode::invalid_argument,
                      fmt::format("found {} s, expected 1 minute to 7 days", invite.valid_s), "valid");
  const auto random = random_bits();
  if (!random) return random.error();
  std::string salt(salt_bytes, '\0');
  if (RAND_bytes(reinterpret_cast<unsigned char*>(salt.data()), static_cast<int>(salt.size())) != 1)
    return make_error(ErrorCode::internal, "the system has no random numbers");
  std::uint64_t secret = *random % net::pairing_secrets;

  AuditEvent event{AuditKind::invite, invite.user};
  event.model = invite.model;
  event.detail = role_name(invite.role);
  const Status done = change(
      [&]() -> Status {
        store::Statement old =
            database_.prepare("DELETE FROM invitations WHERE until_s <= ?1 OR attempts_left <= 0");
        if (!old.bind(1, now_s).run()) return database_.error("invitations");
        const auto open = database_.integer("SELECT COUNT(*) FROM invitations");
        if (!open) return open.error();
        if (*open >= most_invitations)
          return make_error(ErrorCode::resource_exhausted,
                            fmt::format("{} invitations are open already", *open), "invite");
        // Its number is free with a probability of more than 0.999; else the next free one is taken.
        for (;; secret = (secret + keys) % net::pairing_secrets) {
          store::Statement taken = database_.prepare("SELECT 1 FROM invitations WHERE number = ?1");
          if (taken.bind(1, secret / keys).step() != Step::row) break;
        }
        store::Statement insert =
            database_.prepare("INSERT INTO invitations VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8)");
        const std::string hash = hash_of(salt, secret);
        insert.bind(1, secret / keys).bind_bytes(2, salt).bind_bytes(3, hash).bind(4, invite.user);
        insert.bind(5, invite.model).bind(6, std::int64_t{invite.role}).bind(7, now_s + invite.valid_s);
        insert.bind(8, std::int64_t{attempts_per_invitation});
        if (!insert.run()) return database_.error("invitations");
        return {};
      },
      event, now_s);
  if (!done) return done.error();
  return net::write_pairing_code({fingerprint_.substr(0, net::pairing_authority_digits), secret});
}

Result<PairedDevice> AccessFile::pair(const Request& request, Seconds now_s) {
  const auto code = net::read_pairing_code(request.code);
  if (!code) return code.error();
  if (!fingerprint_.starts_with(code->authority)) return wrong_code();
  if (auto good = check_name(request.device, "device"); !good) return good.error();

  const auto number = static_cast<std::int64_t>(code->secret / keys);
  store::Statement find = database_.prepare(
      "SELECT salt, hash, user, model, role, until_s, attempts_left FROM invitations WHERE number = ?1");
  if (find.bind(1, number).step() != Step::row) return wrong_code();
  const std::string salt(find.bytes(0)), hash(find.bytes(1)), user(find.bytes(2));
  PairedDevice paired;
  paired.model = find.bytes(3);
  const auto invited = static_cast<v1::Role>(find.integer(4));
  const bool open = now_s < find.integer(5) && find.integer(6) > 0;
  find.reset();
  const std::string shown = hash_of(salt, code->secret);
  if (!open || CRYPTO_memcmp(shown.data(), hash.data(), std::min(shown.size(), hash.size())) != 0 ||
      shown.size() != hash.size()) {
    // Nobody's roles change, so neither does the generation.
    store::Statement count = database_.prepare(
        "UPDATE invitations SET attempts_left = MAX(attempts_left - 1, 0) WHERE number = ?1");
    if (open && !count.bind(1, number).run()) return database_.error("invitations");
    return wrong_code();
  }

  const net::Validity validity{now_s - day_s, now_s + request.certificate_days * day_s};
  auto certificate = authority_.issue_client(request.certificate_request, user, validity);
  if (!certificate) return certificate.error();
  const auto facts = net::read_certificate(*certificate);
  if (!facts) return facts.error();
  paired.certificate_pem = *std::move(certificate);
  paired.device = {facts->fingerprint, user, request.device, now_s, facts->validity.until_s, 0};

  AuditEvent event{AuditKind::pairing, user, paired.device.fingerprint};
  event.model = paired.model;
  event.detail = fmt::format("{}: {}", role_name(invited), request.device);
  const Status done = change(
      [&]() -> Status {
        // Two devices may show the same code at once: one of them takes it.
        store::Statement take = database_.prepare(
            "DELETE FROM invitations WHERE number = ?1 AND hash = ?2 AND attempts_left > 0 RETURNING 1");
        if (take.bind(1, number).bind_bytes(2, hash).step() != Step::row) return wrong_code();
        while (take.step() == Step::row) {
        }
        take.reset();
        if (auto put = put_user(user, now_s); !put) return put;
        // A second device never takes a role away.
        store::Statement had = database_.prepare("SELECT role FROM roles WHERE user = ?1 AND model = ?2");
        const bool has = had.bind(1, user).bind(2, paired.model).step() == Step::row;
        const auto present = has ? static_cast<v1::Role>(had.integer(0)) : v1::ROLE_UNSPECIFIED;
        had.reset();
        paired.role = rank(invited) > rank(present) ? invited : present;
        if (auto put = put_role(user, paired.model, paired.role); !put) return put;
        store::Statement insert = database_.prepare(
            "INSERT INTO devices (fingerprint, user, name, paired_s, until_s) VALUES (?1, ?2, ?3, ?4, ?5)");
        insert.bind(1, paired.device.fingerprint).bind(2, user).bind(3, request.device);
        insert.bind(4, now_s).bind(5, paired.device.until_s);
        if (!insert.run()) return database_.error("devices");
        return {};
      },
      event, now_s);
  if (!done) return done.error();
  return paired;
}

}  // namespace handloft::access

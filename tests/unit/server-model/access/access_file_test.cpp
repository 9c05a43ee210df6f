// The file of a server's people: invitations, pairings, roles, revocations, the audit log (U2).

#include "server-model/access/access_file.h"

#include <gmock/gmock.h>
#include <sys/stat.h>

#include <fstream>

#include "common/net/pairing_code.h"
#include "server-model/access/names.h"
#include "tests/support/test_data.h"

namespace handloft::access {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr Seconds now = 1'800'000'000;

class AccessFileTest : public ::testing::Test {
 protected:
  std::filesystem::path path() const { return folder_.path() / "server.sqlite"; }
  AccessFile open(AccessFile::Mode mode = AccessFile::Mode::create) const {
    auto file = AccessFile::open(path(), mode, now);
    EXPECT_TRUE(file.ok()) << (file.ok() ? "" : file.error().describe());
    return *std::move(file);
  }
  static std::string request(const std::string& device = "Ann's headset") {
    return *net::make_certificate_request(*net::make_key(), device);
  }
  static std::string invite(AccessFile& file, const std::string& user = "Ann",
                            v1::Role role = v1::ROLE_EDITOR, const std::string& model = "*") {
    auto code = file.invite({user, role, model}, now);
    EXPECT_TRUE(code.ok()) << (code.ok() ? "" : code.error().describe());
    return *code;
  }
  /// The same invitation's number with another secret.
  static std::string wrong_secret(const std::string& code) {
    auto read = *net::read_pairing_code(code);
    read.secret ^= 1;
    return net::write_pairing_code(read);
  }
  test::TemporaryDirectory folder_;
};

TEST_F(AccessFileTest, IsPrivateAndKeepsItsAuthority) {
  std::string fingerprint;
  {
    const AccessFile file = open();
    fingerprint = file.authority_fingerprint();
    struct stat facts {};
    ASSERT_EQ(::stat(path().c_str(), &facts), 0);
    EXPECT_EQ(facts.st_mode & 0777, 0600U);
    struct stat beside {};
    ASSERT_EQ(::stat((path().string() + "-wal").c_str(), &beside), 0);
    EXPECT_EQ(beside.st_mode & 0777, 0600U);
  }
  EXPECT_EQ(open(AccessFile::Mode::existing).authority_fingerprint(), fingerprint);
  ASSERT_EQ(::chmod(path().c_str(), 0640), 0);
  const auto readable = AccessFile::open(path(), AccessFile::Mode::create, now);
  ASSERT_FALSE(readable.ok());
  EXPECT_EQ(readable.error().code, ErrorCode::permission_denied);
}

TEST_F(AccessFileTest, IsMadeInAFolderOfItsOwn) {
  const auto folder = folder_.path() / "access";
  EXPECT_FALSE(AccessFile::open(folder / "people.sqlite", AccessFile::Mode::existing, now).ok());
  EXPECT_FALSE(std::filesystem::exists(folder));
  ASSERT_TRUE(AccessFile::open(folder / "people.sqlite", AccessFile::Mode::create, now).ok());
  struct stat facts {};
  ASSERT_EQ(::stat(folder.c_str(), &facts), 0);
  EXPECT_EQ(facts.st_mode & 0777, 0700U);
  const auto deep = folder_.path() / "no" / "such" / "people.sqlite";
  EXPECT_EQ(AccessFile::open(deep, AccessFile::Mode::create, now).error().code, ErrorCode::io);
}

TEST_F(AccessFileTest, OfSomethingElseIsRefused) {
  EXPECT_EQ(AccessFile::open(path(), AccessFile::Mode::existing, now).error().code, ErrorCode::not_found);
  std::ofstream(path()) << "this is a text of some length that is no database at all, however long one reads";
  ASSERT_EQ(::chmod(path().c_str(), 0600), 0);
  EXPECT_EQ(AccessFile::open(path(), AccessFile::Mode::create, now).error().code, ErrorCode::data_corrupt);
}

TEST_F(AccessFileTest, ADeviceIsPairedByItsCodeOnce) {
  AccessFile file = open();
  const std::string code = invite(file, "Ann", v1::ROLE_COMMENTER, "seat");
  const auto paired = file.pair({code, request(), "Ann's headset"}, now + 60);
  ASSERT_TRUE(paired.ok()) << paired.error().describe();
  const auto facts = net::read_certificate(paired->certificate_pem);
  ASSERT_TRUE(facts.ok());
  EXPECT_EQ(facts->name, "Ann");
  EXPECT_EQ(facts->fingerprint, paired->device.fingerprint);
  EXPECT_EQ(facts->validity.until_s, now + 60 + 730 * 86'400);
  const auto all = file.read();
  ASSERT_TRUE(all.ok());
  ASSERT_THAT(all->people, SizeIs(1));
  ASSERT_THAT(all->people[0].grants, SizeIs(1));
  EXPECT_EQ(all->people[0].grants[0].model, "seat");
  EXPECT_EQ(all->people[0].grants[0].role, v1::ROLE_COMMENTER);
  ASSERT_THAT(all->devices, SizeIs(1));
  EXPECT_EQ(all->devices[0].name, "Ann's headset");
  EXPECT_THAT(all->invitations, IsEmpty());

  const auto again = file.pair({code, request(), "another"}, now + 61);
  ASSERT_FALSE(again.ok());
  EXPECT_EQ(again.error().code, ErrorCode::permission_denied);
  EXPECT_THAT(file.read()->devices, SizeIs(1));
}

TEST_F(AccessFileTest, ACodeEndsInTime) {
  AccessFile file = open();
  const std::string code = invite(file);
  EXPECT_EQ(file.pair({code, request(), "late"}, now + 15 * 60).error().code, ErrorCode::permission_denied);
  EXPECT_TRUE(file.pair({code, request(), "in time"}, now + 15 * 60 - 1).ok());
}

TEST_F(AccessFileTest, WrongSecretsVoidAnInvitation) {
  AccessFile file = open();
  const std::string code = invite(file);
  const std::string other = invite(file, "Bob");
  for (int i = 0; i < attempts_per_invitation; ++i)
    EXPECT_EQ(file.pair({wrong_secret(code), request(), "guess"}, now).error().code,
              ErrorCode::permission_denied);
  EXPECT_EQ(file.pair({code, request(), "right, too late"}, now).error().code, ErrorCode::permission_denied);
  EXPECT_TRUE(file.pair({other, request(), "Bob's"}, now).ok()) << "somebody else's is as good as before";
}

TEST_F(AccessFileTest, FourWrongSecretsDoNot) {
  AccessFile file = open();
  const std::string code = invite(file);
  for (int i = 0; i + 1 < attempts_per_invitation; ++i)
    EXPECT_FALSE(file.pair({wrong_secret(code), request(), "g"}, now).ok());
  EXPECT_TRUE(file.pair({code, request(), "right"}, now).ok());
}

TEST_F(AccessFileTest, ACodeOfAnotherServerAndABadRequestAreRefused) {
  AccessFile file = open();
  const std::string code = invite(file);
  auto read = *net::read_pairing_code(code);
  read.authority[0] = read.authority[0] == '0' ? '1' : '0';
  EXPECT_EQ(file.pair({net::write_pairing_code(read), request(), "d"}, now).error().code,
            ErrorCode::permission_denied);
  EXPECT_EQ(file.pair({code, "no request", "d"}, now).error().code, ErrorCode::data_corrupt);
  EXPECT_EQ(file.pair({code, request(), std::string("d\n")}, now).error().code, ErrorCode::invalid_argument);
  EXPECT_TRUE(file.pair({code, request(), "d"}, now).ok()) << "none of that has used it";
}

TEST_F(AccessFileTest, ASecondDeviceTakesNoRoleAway) {
  AccessFile file = open();
  ASSERT_TRUE(file.set_role("Ann", "*", v1::ROLE_OWNER, now).ok());
  const auto paired = file.pair({invite(file, "Ann", v1::ROLE_VIEWER), request(), "phone"}, now);
  ASSERT_TRUE(paired.ok());
  EXPECT_EQ(paired->role, v1::ROLE_OWNER);
}

TEST_F(AccessFileTest, RevokingAUserTakesDevicesRolesAndInvitations) {
  AccessFile file = open();
  ASSERT_TRUE(file.pair({invite(file), request(), "headset"}, now).ok());
  const std::string open_code = invite(file);
  const auto taken = file.revoke_user("Ann", now + 5);
  ASSERT_TRUE(taken.ok()) << taken.error().describe();
  EXPECT_TRUE(taken->user);
  EXPECT_EQ(in_words(*taken), "1 device, 1 role, 1 invitation");
  const auto all = file.read();
  EXPECT_EQ(all->people[0].revoked_s, now + 5);
  EXPECT_THAT(all->people[0].grants, IsEmpty());
  EXPECT_EQ(all->devices[0].revoked_s, now + 5);
  EXPECT_FALSE(file.pair({open_code, request(), "headset"}, now + 6).ok());
  EXPECT_EQ(file.revoke_user("nobody", now).error().code, ErrorCode::not_found);
  const auto again = file.revoke_user("Ann", now + 7);
  ASSERT_TRUE(again.ok());
  EXPECT_FALSE(again->user);
  EXPECT_EQ(in_words(*again), "nothing");
  EXPECT_EQ(file.read()->people[0].revoked_s, now + 5) << "since then";
}

TEST_F(AccessFileTest, WhoIsOnlyInvitedIsRevokedToo) {
  AccessFile file = open();
  const std::vector<std::string> codes{invite(file, "Mallory", v1::ROLE_OWNER),
                                       invite(file, "Mallory", v1::ROLE_VIEWER, "seat")};
  const std::string other = invite(file, "Bob");
  const std::uint64_t before = *file.generation();
  const auto taken = file.revoke_user("Mallory", now);
  ASSERT_TRUE(taken.ok()) << taken.error().describe();
  EXPECT_FALSE(taken->user);
  EXPECT_EQ(taken->invitations, 2);
  EXPECT_GT(*file.generation(), before);
  for (const std::string& code : codes)
    EXPECT_EQ(file.pair({code, request(), "headset"}, now).error().code, ErrorCode::permission_denied);
  EXPECT_TRUE(file.pair({other, request(), "Bob's"}, now).ok()) << "others stay invited";
  EXPECT_EQ(file.audit(2)->at(0).event.detail, "2 invitations");
  ASSERT_THAT(file.read()->people, SizeIs(1)) << "she has not become a user";
  const std::uint64_t then = *file.generation();
  EXPECT_EQ(file.revoke_user("Mallory", now).error().code, ErrorCode::not_found) << "nothing is left";
  EXPECT_EQ(*file.generation(), then);
}

TEST_F(AccessFileTest, TakingARoleThatNobodyHasIsNotDone) {
  AccessFile file = open();
  const std::uint64_t before = *file.generation();
  const auto nobody = file.set_role("Zoe", "*", v1::ROLE_UNSPECIFIED, now);
  ASSERT_FALSE(nobody.ok());
  EXPECT_EQ(nobody.error().code, ErrorCode::not_found);
  EXPECT_EQ(nobody.error().field, "user");
  EXPECT_EQ(*file.generation(), before);
  EXPECT_THAT(*file.audit(1), IsEmpty());

  ASSERT_TRUE(file.set_role("Ann", "*", v1::ROLE_EDITOR, now).ok());
  invite(file, "Ann", v1::ROLE_OWNER, "hood");
  const auto elsewhere = file.set_role("Ann", "seat", v1::ROLE_UNSPECIFIED, now);
  ASSERT_FALSE(elsewhere.ok());
  EXPECT_EQ(elsewhere.error().code, ErrorCode::not_found);
  EXPECT_EQ(
      elsewhere.error().message,
      "found no role of \"Ann\" on \"seat\", only: editor on every model, invited as owner on \"hood\"");
  const auto taken = file.set_role("Ann", "*", v1::ROLE_UNSPECIFIED, now);
  ASSERT_TRUE(taken.ok()) << taken.error().describe();
  EXPECT_EQ(in_words(*taken), "1 role");
  EXPECT_THAT(file.read()->invitations, SizeIs(1)) << "that to another model stays";
  EXPECT_FALSE(file.set_role("Ann", "*", v1::ROLE_UNSPECIFIED, now).ok());
}

TEST_F(AccessFileTest, TakingARoleTakesTheInvitationsThatWouldGiveItBack) {
  AccessFile file = open();
  const std::string code = invite(file, "Mallory", v1::ROLE_OWNER, "seat");
  EXPECT_EQ(file.set_role("Mallory", "hood", v1::ROLE_UNSPECIFIED, now).error().code, ErrorCode::not_found);
  const auto taken = file.set_role("Mallory", "seat", v1::ROLE_UNSPECIFIED, now);
  ASSERT_TRUE(taken.ok()) << taken.error().describe();
  EXPECT_EQ(in_words(*taken), "1 invitation");
  EXPECT_EQ(file.pair({code, request(), "d"}, now).error().code, ErrorCode::permission_denied);
  EXPECT_THAT(file.read()->people, IsEmpty());
  EXPECT_EQ(file.audit(1)->at(0).event.detail, "none; withdrawn: 1 invitation");
}

TEST_F(AccessFileTest, ARoleIsOnlyGivenOnWhatCanBeAModel) {
  AccessFile file = open();
  for (const char* model : {"../x", "a/b", ".", "a b", "-a", "\xC3\xA4"}) {
    EXPECT_EQ(file.set_role("Ann", model, v1::ROLE_EDITOR, now).error().field, "model") << model;
    EXPECT_EQ(file.set_role("Ann", model, v1::ROLE_UNSPECIFIED, now).error().code,
              ErrorCode::invalid_argument)
        << model;
    EXPECT_EQ(file.invite({"Ann", v1::ROLE_EDITOR, model}, now).error().field, "model") << model;
  }
  EXPECT_THAT(file.read()->people, IsEmpty());
  // A file from before has such a one.
  auto database = store::Database::open(path(), store::Database::Access::write, "");
  ASSERT_TRUE(database.ok());
  ASSERT_TRUE(database->execute("INSERT INTO users (name, made_s) VALUES ('Ann', 1)").ok());
  ASSERT_TRUE(database->execute("INSERT INTO roles VALUES ('Ann', 'my seat', 3)").ok());
  EXPECT_TRUE(file.set_role("Ann", "my seat", v1::ROLE_UNSPECIFIED, now).ok());
  EXPECT_THAT(file.read()->people.at(0).grants, IsEmpty());
}

TEST(Granted, IsTheGreaterOfOneModelAndEvery) {
  Person ann{"Ann", 1, 0, {{"*", v1::ROLE_COMMENTER}, {"seat", v1::ROLE_OWNER}, {"hood", v1::ROLE_VIEWER}}};
  EXPECT_EQ(granted(ann, "seat"), v1::ROLE_OWNER);
  EXPECT_EQ(granted(ann, "hood"), v1::ROLE_COMMENTER);
  EXPECT_EQ(granted(ann, "mouse"), v1::ROLE_COMMENTER);
  EXPECT_EQ(granted(ann, every_model), v1::ROLE_COMMENTER);
  ann.revoked_s = 2;
  EXPECT_EQ(granted(ann, "seat"), v1::ROLE_UNSPECIFIED);
}

TEST_F(AccessFileTest, RevokesADeviceByTheBeginningOfItsFingerprint) {
  AccessFile file = open();
  const auto paired = file.pair({invite(file), request(), "headset"}, now);
  ASSERT_TRUE(paired.ok());
  EXPECT_EQ(file.revoke_device(paired->device.fingerprint.substr(0, 7), now).error().code,
            ErrorCode::not_found);
  const auto revoked = file.revoke_device(paired->device.fingerprint.substr(0, 8), now + 1);
  ASSERT_TRUE(revoked.ok()) << revoked.error().describe();
  EXPECT_EQ(revoked->name, "headset");
  EXPECT_EQ(file.read()->devices[0].revoked_s, now + 1);
}

TEST_F(AccessFileTest, TellsOthersWhenItHasChanged) {
  AccessFile server = open();
  ASSERT_TRUE(server.touched().ok());
  const std::uint64_t before = *server.generation();
  EXPECT_FALSE(*server.touched());
  AccessFile command = open(AccessFile::Mode::existing);
  ASSERT_TRUE(command.set_role("Ann", "*", v1::ROLE_VIEWER, now).ok());
  EXPECT_TRUE(*server.touched());
  EXPECT_GT(*server.generation(), before);
  ASSERT_TRUE(command.add_audit({{AuditKind::join, "Ann"}}, 1, 10).ok());
  EXPECT_TRUE(*server.touched());
  EXPECT_EQ(*server.generation(), before + 1) << "an audit entry changes nobody's role";
}

TEST_F(AccessFileTest, KeepsTheNewestAuditEntries) {
  AccessFile file = open();
  for (int batch = 0; batch < 30; ++batch) {
    std::vector<AuditEvent> events(10, AuditEvent{AuditKind::join, "Ann"});
    events.back().detail = std::to_string(batch);
    ASSERT_TRUE(file.add_audit(events, batch, 25).ok());
  }
  const auto entries = file.audit(1000);
  ASSERT_TRUE(entries.ok());
  ASSERT_THAT(*entries, SizeIs(25));
  EXPECT_EQ(entries->back().event.detail, "29");
  EXPECT_EQ(entries->back().number, 300);
  EXPECT_THAT(*file.audit(3), SizeIs(3));
}

TEST_F(AccessFileTest, AuditsWhatCommandsDo) {
  AccessFile file = open();
  const auto paired = file.pair({invite(file), request(), "headset"}, now);
  ASSERT_TRUE(file.set_role("Ann", "seat", v1::ROLE_OWNER, now).ok());
  ASSERT_TRUE(file.revoke_device(paired->device.fingerprint, now).ok());
  ASSERT_TRUE(file.revoke_user("Ann", now).ok());
  std::vector<std::string> kinds;
  const auto entries = file.audit(10);
  ASSERT_TRUE(entries.ok());
  for (const AuditEntry& entry : *entries) kinds.push_back(entry.kind);
  EXPECT_THAT(kinds, ElementsAre("invite", "pairing", "role", "revocation", "revocation"));
}

TEST_F(AccessFileTest, NothingOfAStrangersTextMovesATerminal) {
  AccessFile file = open();
  AuditEvent event{AuditKind::refusal};
  event.detail = std::string("\x1b[2J") + "\xff" + std::string(5000, 'x');
  event.address = "a\nb";
  ASSERT_TRUE(file.add_audit({event}, 1, 10).ok());
  const AuditEntry entry = file.audit(1)->at(0);
  EXPECT_THAT(entry.event.detail, HasSubstr(" [2J?xxx"));
  EXPECT_LE(entry.event.detail.size(), 300U);
  EXPECT_EQ(entry.event.address, "a b");
}

TEST_F(AccessFileTest, ChecksWhatCommandsSay) {
  AccessFile file = open();
  EXPECT_EQ(file.invite({"", v1::ROLE_EDITOR}, now).error().field, "name");
  EXPECT_EQ(file.invite({"*", v1::ROLE_EDITOR}, now).error().field, "name");
  EXPECT_EQ(file.invite({"Ann", v1::ROLE_SUBSCRIBER}, now).error().field, "role");
  EXPECT_EQ(file.invite({"Ann", v1::ROLE_EDITOR, "*", 59}, now).error().field, "valid");
  EXPECT_EQ(file.invite({"Ann", v1::ROLE_EDITOR, "*", 8 * 86'400}, now).error().field, "valid");
  EXPECT_EQ(file.set_role(std::string(65, 'a'), "*", v1::ROLE_EDITOR, now).error().field, "user");
  EXPECT_EQ(file.set_role("Ann", "", v1::ROLE_EDITOR, now).error().field, "model");
}

TEST(Names, ArePlainText) {
  EXPECT_TRUE(check_name("Zoë", "name").ok());
  EXPECT_FALSE(check_name("Zo\xeb", "name").ok());
  EXPECT_EQ(plain("a\x7f"), "a ");
  EXPECT_EQ(plain("\xc2\x9b"
                  "x"),
            " x");
  EXPECT_EQ(plain("\xed\xa0\x80"), "???");
  EXPECT_EQ(plain("\xf4\x90\x80\x80"), "????");
  EXPECT_EQ(plain("ääää", 5), "ää") << "no half letters";
}

}  // namespace
}  // namespace handloft::access

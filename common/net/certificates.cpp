#include "common/net/certificates.h"

#include <fmt/format.h>
#include <openssl/asn1.h>
#include <openssl/bn.h>
#include <openssl/pem.h>
#include <openssl/rand.h>
#include <openssl/x509v3.h>

#include <algorithm>
#include <array>
#include <ctime>
#include <utility>
#include <vector>

#include "common/net/openssl_handles.h"

namespace handloft::net {

namespace {

constexpr std::size_t max_name_bytes = 64;  // RFC 5280's bound of a common name.
constexpr std::size_t serial_bytes = 16;

Error bad_name(const std::string& name) {
  return make_error(ErrorCode::invalid_argument,
                    fmt::format("found a name of {} bytes, expected 1 to {} without control characters",
                                name.size(), max_name_bytes),
                    "name");
}

bool good_name(const std::string& name) {
  return !name.empty() && name.size() <= max_name_bytes && std::none_of(name.begin(), name.end(), [](char c) {
    return static_cast<unsigned char>(c) < 0x20 || c == 0x7f;
  });
}

bool set_name(X509_NAME* subject, const std::string& name) {
  return X509_NAME_add_entry_by_txt(subject, "CN", MBSTRING_UTF8,
                                    reinterpret_cast<const unsigned char*>(name.data()),
                                    static_cast<int>(name.size()), -1, 0) == 1;
}

template <auto write, typename T>
Result<std::string> to_pem(T* object, std::string_view what) {
  const BioHandle bio(BIO_new(BIO_s_mem()));
  if (!bio || write(bio.get(), object) != 1) return openssl_error(what);
  return text_of(bio.get());
}

Result<std::string> key_to_pem(EVP_PKEY* key) {
  const BioHandle bio(BIO_new(BIO_s_mem()));
  if (!bio || PEM_write_bio_PrivateKey(bio.get(), key, nullptr, nullptr, 0, nullptr, nullptr) != 1)
    return openssl_error("writing a key");
  return text_of(bio.get());
}

/// Random and positive (RFC 5280, 4.1.2.2).
bool set_random_serial(X509* certificate) {
  std::array<unsigned char, serial_bytes> bytes{};
  if (RAND_bytes(bytes.data(), static_cast<int>(bytes.size())) != 1) return false;
  bytes[0] = static_cast<unsigned char>((bytes[0] & 0x3fU) | 0x40U);
  const std::unique_ptr<BIGNUM, OpensslDeleter<&BN_free>> number(
      BN_bin2bn(bytes.data(), static_cast<int>(bytes.size()), nullptr));
  return number && BN_to_ASN1_INTEGER(number.get(), X509_get_serialNumber(certificate)) != nullptr;
}

bool add_extension(X509* certificate, X509* issuer, int kind, const char* value) {
  X509V3_CTX context;
  X509V3_set_ctx_nodb(&context);
  X509V3_set_ctx(&context, issuer, certificate, nullptr, nullptr, 0);
  const std::unique_ptr<X509_EXTENSION, OpensslDeleter<&X509_EXTENSION_free>> extension(
      X509V3_EXT_conf_nid(nullptr, &context, kind, value));
  return extension && X509_add_ext(certificate, extension.get(), -1) == 1;
}

struct Extension {
  int kind;
  std::string value;
};

struct Signing {
  X509* issuer = nullptr;  ///< Null: the certificate's own.
  EVP_PKEY* key = nullptr;
};

Result<std::string> sign_certificate(EVP_PKEY* subject_key, const std::string& name, Validity validity,
                                     const std::vector<Extension>& extensions, const Signing& signing) {
  if (!good_name(name)) return bad_name(name);
  if (validity.until_s <= validity.from_s)
    return make_error(ErrorCode::invalid_argument, "found an end before the beginning", "validity");
  const CertificateHandle certificate(X509_new());
  if (!certificate) return openssl_error("a certificate");
  X509* made = certificate.get();
  X509* issuer = signing.issuer != nullptr ? signing.issuer : made;
  bool good = X509_set_version(made, X509_VERSION_3) == 1 && set_random_serial(made) &&
              set_name(X509_get_subject_name(made), name) &&
              X509_set_issuer_name(made, X509_get_subject_name(issuer)) == 1 &&
              ASN1_TIME_set(X509_getm_notBefore(made), validity.from_s) != nullptr &&
              ASN1_TIME_set(X509_getm_notAfter(made), validity.until_s) != nullptr &&
              X509_set_pubkey(made, subject_key) == 1;
  for (const Extension& extension : extensions)
    good = good && add_extension(made, issuer, extension.kind, extension.value.c_str());
  // Ed25519 hashes by itself: no digest.
  if (!good || X509_sign(made, signing.key, nullptr) == 0) return openssl_error("signing a certificate");
  return to_pem<&PEM_write_bio_X509>(made, "writing a certificate");
}

std::int64_t seconds_of(const ASN1_TIME* time) {
  std::tm parts{};
  if (time == nullptr || ASN1_TIME_to_tm(time, &parts) != 1) return 0;
  return timegm(&parts);
}

}  // namespace

Result<std::string> make_key() {
  const KeyHandle key(EVP_PKEY_Q_keygen(nullptr, nullptr, "ED25519"));
  if (!key) return openssl_error("making a key");
  return key_to_pem(key.get());
}

Result<std::string> make_certificate_request(const std::string& key_pem, const std::string& name) {
  if (!good_name(name)) return bad_name(name);
  const KeyHandle key = key_of(key_pem);
  if (!key) return make_error(ErrorCode::invalid_argument, "found no private key in PEM", "key");
  const RequestHandle request(X509_REQ_new());
  if (!request || X509_REQ_set_version(request.get(), X509_REQ_VERSION_1) != 1 ||
      !set_name(X509_REQ_get_subject_name(request.get()), name) ||
      X509_REQ_set_pubkey(request.get(), key.get()) != 1 ||
      X509_REQ_sign(request.get(), key.get(), nullptr) == 0)
    return openssl_error("a certificate request");
  return to_pem<&PEM_write_bio_X509_REQ>(request.get(), "writing a request");
}

Result<CertificateFacts> read_certificate(const std::string& certificate_pem) {
  const CertificateHandle certificate = certificate_of(certificate_pem);
  if (!certificate) return make_error(ErrorCode::data_corrupt, "found no certificate in PEM", "certificate");
  CertificateFacts facts;
  std::array<char, max_name_bytes + 1> name{};
  const int length = X509_NAME_get_text_by_NID(X509_get_subject_name(certificate.get()), NID_commonName,
                                               name.data(), static_cast<int>(name.size()));
  if (length > 0) facts.name.assign(name.data(), static_cast<std::size_t>(length));
  const std::unique_ptr<BIGNUM, OpensslDeleter<&BN_free>> number(
      ASN1_INTEGER_to_BN(X509_get0_serialNumber(certificate.get()), nullptr));
  if (number) {
    char* hex = BN_bn2hex(number.get());
    if (hex != nullptr) facts.serial = hex;
    OPENSSL_free(hex);
    std::transform(facts.serial.begin(), facts.serial.end(), facts.serial.begin(),
                   [](char c) { return c >= 'A' && c <= 'F' ? static_cast<char>(c - 'A' + 'a') : c; });
  }
  facts.fingerprint = fingerprint_of(certificate.get());
  facts.validity = {seconds_of(X509_get0_notBefore(certificate.get())),
                    seconds_of(X509_get0_notAfter(certificate.get()))};
  return facts;
}

Result<CertificateAuthority> CertificateAuthority::create(const std::string& name, Validity validity) {
  const Result<std::string> key_pem = make_key();
  if (!key_pem) return key_pem.error();
  const KeyHandle key = key_of(*key_pem);
  const Result<std::string> certificate =
      sign_certificate(key.get(), name, validity,
                       {{NID_basic_constraints, "critical,CA:TRUE,pathlen:0"},
                        {NID_key_usage, "critical,keyCertSign,cRLSign"},
                        {NID_subject_key_identifier, "hash"}},
                       {nullptr, key.get()});
  if (!certificate) return certificate.error();
  return CertificateAuthority({*certificate, *key_pem});
}

Result<CertificateAuthority> CertificateAuthority::load(const TlsIdentity& identity) {
  const CertificateHandle certificate = certificate_of(identity.certificate_pem);
  if (!certificate)
    return make_error(ErrorCode::data_corrupt, "found no certificate in PEM", "authority.certificate");
  const KeyHandle key = key_of(identity.key_pem);
  if (!key) return make_error(ErrorCode::data_corrupt, "found no private key in PEM", "authority.key");
  const bool its_own = X509_check_private_key(certificate.get(), key.get()) == 1;
  ERR_clear_error();
  if (!its_own)
    return make_error(ErrorCode::data_corrupt, "the key is not the certificate's", "authority.key");
  if (X509_check_ca(certificate.get()) != 1)
    return make_error(ErrorCode::data_corrupt, "the certificate is none of an authority",
                      "authority.certificate");
  return CertificateAuthority(identity);
}

Result<TlsIdentity> CertificateAuthority::issue_server(Validity validity) const {
  const Result<std::string> key_pem = make_key();
  if (!key_pem) return key_pem.error();
  const KeyHandle key = key_of(*key_pem), own_key = key_of(identity_.key_pem);
  const CertificateHandle own = certificate_of(identity_.certificate_pem);
  const Result<std::string> certificate =
      sign_certificate(key.get(), std::string(tls_server_name), validity,
                       {{NID_basic_constraints, "critical,CA:FALSE"},
                        {NID_key_usage, "critical,digitalSignature"},
                        {NID_ext_key_usage, "serverAuth"},
                        {NID_subject_alt_name, fmt::format("DNS:{}", tls_server_name)},
                        {NID_authority_key_identifier, "keyid"}},
                       {own.get(), own_key.get()});
  if (!certificate) return certificate.error();
  return TlsIdentity{*certificate, *key_pem};
}

Result<std::string> CertificateAuthority::issue_client(const std::string& request_pem,
                                                       const std::string& name, Validity validity) const {
  const BioHandle bio(BIO_new_mem_buf(request_pem.data(), static_cast<int>(request_pem.size())));
  const RequestHandle request(PEM_read_bio_X509_REQ(bio.get(), nullptr, nullptr, nullptr));
  ERR_clear_error();
  if (!request) return make_error(ErrorCode::data_corrupt, "found no certificate request in PEM", "request");
  EVP_PKEY* key = X509_REQ_get0_pubkey(request.get());
  if (key == nullptr || EVP_PKEY_get_base_id(key) != EVP_PKEY_ED25519) {
    ERR_clear_error();
    return make_error(ErrorCode::invalid_argument, "found a key of another kind, expected Ed25519",
                      "request.key");
  }
  const bool signed_by_itself = X509_REQ_verify(request.get(), key) == 1;
  ERR_clear_error();
  if (!signed_by_itself)
    return make_error(ErrorCode::data_corrupt, "the request is not signed by its own key", "request");
  const KeyHandle own_key = key_of(identity_.key_pem);
  const CertificateHandle own = certificate_of(identity_.certificate_pem);
  return sign_certificate(key, name, validity,
                          {{NID_basic_constraints, "critical,CA:FALSE"},
                           {NID_key_usage, "critical,digitalSignature"},
                           {NID_ext_key_usage, "clientAuth"},
                           {NID_authority_key_identifier, "keyid"}},
                          {own.get(), own_key.get()});
}

}  // namespace handloft::net

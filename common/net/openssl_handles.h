#pragma once
// OpenSSL's objects, freed with their owner. Only for files that speak to OpenSSL themselves.

#include <openssl/bio.h>
#include <openssl/err.h>
#include <openssl/evp.h>
#include <openssl/ssl.h>
#include <openssl/x509.h>

#include <memory>
#include <string>
#include <string_view>

#include "common/base/result.h"

namespace handloft::net {

template <auto free_it>
struct OpensslDeleter {
  template <typename T>
  void operator()(T* held) const {
    free_it(held);
  }
};
using BioHandle = std::unique_ptr<BIO, OpensslDeleter<&BIO_free_all>>;
using KeyHandle = std::unique_ptr<EVP_PKEY, OpensslDeleter<&EVP_PKEY_free>>;
using CertificateHandle = std::unique_ptr<X509, OpensslDeleter<&X509_free>>;
using RequestHandle = std::unique_ptr<X509_REQ, OpensslDeleter<&X509_REQ_free>>;
using ContextHandle = std::unique_ptr<SSL_CTX, OpensslDeleter<&SSL_CTX_free>>;
using SessionHandle = std::unique_ptr<SSL, OpensslDeleter<&SSL_free>>;

/// The library's oldest complaint of this thread, in words; the others are forgotten.
std::string openssl_complaint();
/// `what` and the complaint, as an internal error.
Error openssl_error(std::string_view what);

/// Null when it is none. Encrypted keys are none: nobody is asked for a password.
CertificateHandle certificate_of(std::string_view pem);
KeyHandle key_of(std::string_view pem);
/// The bytes that were written to a memory BIO.
std::string text_of(BIO* memory);
/// SHA-256, lower-case hexadecimal; empty when the library fails.
std::string fingerprint_of(const X509* certificate);

}  // namespace handloft::net

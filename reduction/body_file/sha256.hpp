#pragma once

#include <memory>
#include <string>
#include <string_view>

struct evp_md_ctx_st;  // of OpenSSL

namespace flexboom {

/// SHA-256 (FIPS 180-4) of bytes that come piece by piece, by OpenSSL.
class Sha256 {
 public:
  /// @throws NumericalError when OpenSSL refuses.
  Sha256();

  void add(std::string_view bytes);

  /// 64 hexadecimal digits of everything added. Call it once, last.
  std::string digest();

 private:
  struct Free {
    void operator()(evp_md_ctx_st* context) const;
  };
  std::unique_ptr<evp_md_ctx_st, Free> context_;
};

std::string sha256(std::string_view bytes);

}  // namespace flexboom

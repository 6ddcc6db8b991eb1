// The credentials that a client shows a server, and that it wants to be shown; and to which servers.
#ifndef WELLSPACE_CLIENT_CONNECT_OPTIONS_H_
#define WELLSPACE_CLIENT_CONNECT_OPTIONS_H_

#include <string>

namespace wellspace::client {

// Paths are of PEM files, read when the connection is made.
struct ConnectOptions {
  bool tls = false;                  // also on where one of the next three is given; otherwise plain text
  std::string tls_ca = "";           // authorities of the server's certificate; empty: all that this machine trusts
  std::string tls_certificate = "";  // this client's own, then those between it and its authority
  std::string tls_key = "";          // of the certificate

  std::string token = "";        // for the metadata `authorization: Bearer TOKEN`
  std::string token_file = "";   // has the token instead; read anew for each call
  bool insecure_remote = false;  // lets the token go to other machines in plain text

  // Of several servers that share their sessions, calls on a session go to the one that has it, by the address that the
  // others name, with the same credentials. Off: to this one alone, behind which a proxy finds the right one.
  bool follow = true;
};

}  // namespace wellspace::client

#endif  // WELLSPACE_CLIENT_CONNECT_OPTIONS_H_

// flood SECONDS: sends packets that nobody can read to the first participant on this computer, as fast as it can.

#include <arpa/inet.h>
#include <sys/socket.h>

#include <chrono>
#include <cstdlib>
#include <cstring>

int main(int, char** argv) {
  const int socket = ::socket(AF_INET, SOCK_DGRAM, 0);
  sockaddr_in to = {};
  to.sin_family = AF_INET;
  to.sin_addr.s_addr = inet_addr("127.0.0.1");
  char packet[200];
  std::memset(packet, 7, sizeof packet);
  // The beginning is as it should be.
  std::memcpy(packet, "RTPS\2\1\1\20", 8);
  const auto end = std::chrono::steady_clock::now() + std::chrono::seconds(std::atoi(argv[1]));
  while (std::chrono::steady_clock::now() < end) {
    for (unsigned count = 0; count < 1000; ++count) {
      to.sin_port = htons(static_cast<std::uint16_t>(7410 + count % 2));
      sendto(socket, packet, 20 + count % 180, 0, reinterpret_cast<const sockaddr*>(&to), sizeof to);
    }
  }
}

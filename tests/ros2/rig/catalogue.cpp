// Reads samples with so much room for their sequences, and writes what it has read: each line of the input has the bytes of one in
// hexadecimal, and of the output `-` where it is malformed, `+` where it is too large.

#include <mauve/cdr.hpp>

#include <iostream>
#include <string>

#include "messages.hpp"

int main(int, char** arguments) {
  std::string line;
  while (std::getline(std::cin, line)) {
    std::string bytes;
    for (std::size_t at = 0; at + 1 < line.size(); at += 2) bytes += static_cast<char>(std::stoi(line.substr(at, 2), nullptr, 16));
    rig::msg::All message;
    try {
      if (!mauve::cdr::read(bytes.data(), bytes.size(), std::stoul(arguments[1]), message)) {
        std::cout << "-\n";
        continue;
      }
    } catch (const std::bad_alloc&) {
      std::cout << "+\n";
      continue;
    }
    std::string out(mauve::cdr::size(message), '\0');
    mauve::cdr::write(message, &out[0]);
    for (const char byte : out) {
      const char digits[] = "0123456789abcdef";
      std::cout << digits[static_cast<unsigned char>(byte) >> 4] << digits[byte & 15];
    }
    std::cout << "\n";
  }
}

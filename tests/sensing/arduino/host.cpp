// Runs the sketch for some seconds of the board's time; its bytes go to standard output.
#include "Arduino.h"

#include <stdlib.h>

Board board;
Port Serial;

#include "mu_sensor.ino"

int main(int count, char **words) {
  const uint32_t seconds = atoi(words[1]);
  const int full_from = count > 2 ? atoi(words[2]) : -1;  // frames after which the buffer is full, for ten
  const uint32_t start = board.now_us;
  setup();
  while (board.now_us - start < seconds * 1000000u) {
    board.room = full_from >= 0 && (int)number >= full_from && (int)number < full_from + 10 ? 3 : 1000000;
    loop();
  }
}

/* The glove: reads its sensors 250 times a second and tells the computer (README.md has the wiring). */
#include <avr/eeprom.h>
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/wdt.h>

#include "glove_logic.h"
#include "usb.h"

/* Analogue inputs: force at A1 (PF6, ADC6), potentiometer at A0 (PF7, ADC7). */
enum { FORCE_CHANNEL = 6, POTENTIOMETER_CHANNEL = 7 };

/* A quarter of the EEPROM's start is left free: bootloaders and other sketches use its first bytes. */
static uint8_t* const stored_range = (uint8_t*)256;

static glove_range range;
static glove_pulse pulse;
static uint8_t to_store[GLOVE_RANGE_SIZE];
static uint8_t stored = GLOVE_RANGE_SIZE; /* Bytes of `to_store` that are in the EEPROM already. */
static volatile uint32_t time_us;         /* Of timer 0's last overflow. */
static uint32_t last_now_us;

/* ---- time: timer 0 counts F_CPU / 8 ---- */

enum { TICKS_PER_US = F_CPU / 8000000UL, OVERFLOW_US = 256 / (F_CPU / 8000000UL) };

ISR(TIMER0_OVF_vect) {
  time_us += OVERFLOW_US;
}

static void time_begin(void) {
  TCCR0A = 0;
  TCCR0B = 1 << CS01; /* By 8. */
  TIMSK0 = 1 << TOIE0;
}

static uint32_t now_us(void) {
  const uint8_t saved = SREG;
  cli();
  uint8_t ticks = TCNT0;
  uint32_t base = time_us;
  if ((TIFR0 & (1 << TOV0)) && ticks < 128) base += OVERFLOW_US; /* Overflowed just now, not counted yet. */
  SREG = saved;
  return base + ticks / TICKS_PER_US;
}

/* ---- sensors ---- */

static void sensors_begin(void) {
  /* PF4 to PF7 are JTAG's after a reset, unless a fuse says no: written twice within four cycles. */
  MCUCR = 1 << JTD;
  MCUCR = 1 << JTD;
  ADMUX = 1 << REFS0; /* Against the supply, as the divider is. */
  ADCSRA = (1 << ADEN) | (1 << ADPS2) | (1 << ADPS1) | (1 << ADPS0); /* By 128: 125 kHz, 104 us each. */
  DIDR0 = (1 << ADC6D) | (1 << ADC7D);
  /* Pads with pull-ups: D2 D3 D4 D7 A2 A3. */
  PORTD |= (1 << PORTD1) | (1 << PORTD0) | (1 << PORTD4);
  PORTE |= 1 << PORTE6;
  PORTF |= (1 << PORTF5) | (1 << PORTF4);
}

static uint16_t convert(uint8_t channel) {
  uint16_t samples[GLOVE_SAMPLES];
  ADMUX = (uint8_t)((1 << REFS0) | channel);
  for (uint8_t i = 0; i <= GLOVE_SAMPLES; ++i) {
    ADCSRA |= 1 << ADSC;
    while (ADCSRA & (1 << ADSC)) {
    }
    const uint16_t value = ADC;
    if (i > 0)
      samples[i - 1] = value; /* The first after a change of channel still holds some of the other. */
  }
  return glove_median(samples, GLOVE_SAMPLES);
}

static uint8_t pad_pins(void) {
  uint8_t pins = 0;
  if (PIND & (1 << PIND1)) pins |= 1 << 0; /* D2 index */
  if (PIND & (1 << PIND0)) pins |= 1 << 1; /* D3 middle */
  if (PIND & (1 << PIND4)) pins |= 1 << 2; /* D4 ring */
  if (PINE & (1 << PINE6)) pins |= 1 << 3; /* D7 little */
  if (PINF & (1 << PINF5)) pins |= 1 << 4; /* A2 thumb */
  if (PINF & (1 << PINF4)) pins |= 1 << 5; /* A3 table */
  return pins;
}

/* ---- light and vibration ---- */

static void actuators_begin(void) {
  DDRB |= (1 << DDB5) | (1 << DDB6); /* D9 red, D10 green */
  DDRD |= 1 << DDD7;                 /* D6 blue */
  DDRC |= 1 << DDC6;                 /* D5 motor */
  TCCR1A = 1 << WGM10;               /* 8 bits, fast, by 64: 977 Hz */
  TCCR1B = (1 << WGM12) | (1 << CS11) | (1 << CS10);
  TCCR3A = 1 << WGM30;
  TCCR3B = (1 << WGM32) | (1 << CS31) | (1 << CS30);
  TCCR4B = (1 << CS42) | (1 << CS41) | (1 << CS40); /* By 64 */
  TC4H = 0;
  OCR4C = 255;
}

static void show(uint8_t red, uint8_t green, uint8_t blue) {
  OCR1A = red;
  OCR1B = green;
  TC4H = 0;
  OCR4D = blue;
  /* Fast PWM at 0 still gives a spike: off is the pin's own low. */
  TCCR1A = (uint8_t)((1 << WGM10) | (red ? 1 << COM1A1 : 0) | (green ? 1 << COM1B1 : 0));
  TCCR4C = (uint8_t)(blue ? (1 << COM4D1) | (1 << PWM4D) : 0);
}

static void vibrate(uint8_t strength) {
  OCR3A = strength;
  TCCR3A = (uint8_t)((1 << WGM30) | (strength ? 1 << COM3A1 : 0));
}

/* ---- reports ---- */

static glove_state state = {.battery_percent = 100}; /* The bus powers it. */

static void read_sensors(uint32_t now) {
  state.time_us = now;
  state.contacts = glove_contacts(pad_pins());
  state.force = convert(FORCE_CHANNEL);
  state.potentiometer = convert(POTENTIOMETER_CHANNEL);
}

static uint8_t get_report(uint8_t type, uint8_t id, uint8_t* into) {
  if (type == USB_REPORT_FEATURE && id == GLOVE_RANGE_ID) {
    glove_range_pack(&range, into);
    return GLOVE_RANGE_SIZE;
  }
  if (type == USB_REPORT_INPUT && id == GLOVE_REPORT_ID) {
    glove_pack(&state, into);
    return GLOVE_REPORT_SIZE;
  }
  return 0;
}

static bool set_report(uint8_t type, const uint8_t* report, uint8_t size) {
  if (type == USB_REPORT_OUTPUT) {
    glove_output output;
    if (!glove_output_parse(report, size, &output)) return false;
    show(output.red, output.green, output.blue);
    glove_pulse_start(&pulse, &output, last_now_us);
    return true;
  }
  if (type == USB_REPORT_FEATURE && glove_range_parse(report, size, &range)) {
    for (uint8_t i = 0; i < GLOVE_RANGE_SIZE; ++i) to_store[i] = report[i];
    stored = 0;
    return true;
  }
  return false;
}

/* A byte takes 3.4 ms, so they are written one after the other between reports. */
static void store_some(void) {
  if (stored == GLOVE_RANGE_SIZE || !eeprom_is_ready()) return;
  eeprom_update_byte(stored_range + stored, to_store[stored]);
  ++stored;
}

static void load_range(void) {
  uint8_t bytes[GLOVE_RANGE_SIZE];
  eeprom_read_block(bytes, stored_range, sizeof bytes);
  glove_range_default(&range);
  glove_range_parse(bytes, sizeof bytes, &range);
}

int main(void) {
  /* A bootloader may leave its watchdog, its timers and its interrupts running. */
  cli();
  MCUSR = 0;
  wdt_disable();
  static const usb_hid_handlers handlers = {get_report, set_report};
  static glove_schedule schedule;
  time_begin();
  sensors_begin();
  actuators_begin();
  load_range();
  sei();
  usb_begin(&handlers);
  wdt_enable(WDTO_1S);
  bool was_ready = false;
  uint8_t restarted = 0;
  while (true) {
    wdt_reset();
    usb_poll();
    const uint32_t now = last_now_us = now_us();
    vibrate(glove_pulse_level(&pulse, now));
    store_some();
    const bool is_ready = usb_is_ready();
    if (is_ready != was_ready) {
      was_ready = is_ready;
      restarted = 4; /* The first few reports say so; one may be lost. */
      if (!is_ready) {
        show(0, 0, 0);
        pulse.strength = 0;
      }
    }
    const uint16_t due = glove_due(&schedule, now);
    if (due == 0) continue;
    state.sequence = (uint16_t)(state.sequence + due);
    if (!is_ready) continue;
    read_sensors(now);
    state.flags = restarted > 0 ? GLOVE_FLAG_RESTARTED : 0;
    uint8_t report[GLOVE_REPORT_SIZE];
    glove_pack(&state, report);
    if (usb_send_report(report, sizeof report) && restarted > 0) --restarted;
  }
}

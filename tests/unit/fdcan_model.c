/* SPDX-License-Identifier: MIT */
/* Implements fdcan_model.h (see there): a register model of FDCAN1 of an STM32G4. Part of the C tests; no I/O. */
#include "fdcan_model.h"

#include <string.h>

#include "stm32g4_chip.h"

#define REGISTERS     0x40006400u
#define REGISTERS_END 0x40006800u
#define RAM           0x4000A400u
#define RAM_BYTES     0x350u

enum {
    CREL = 0x00,
    ENDN = 0x04,
    CCCR = 0x18,
    NBTP = 0x1C,
    ECR = 0x40,
    PSR = 0x44,
    IR = 0x50,
    IE = 0x54,
    ILS = 0x58,
    ILE = 0x5C,
    RXGFC = 0x80,
    RXF0S = 0x90,
    RXF0A = 0x94,
    TXBC = 0xC0,
    TXFQS = 0xC4,
    TXBRP = 0xC8,
    TXBAR = 0xCC,
    TXBCR = 0xD0,
    TXBTO = 0xD4,
    TXBCF = 0xD8,
    TXBTIE = 0xDC,
};

enum {
    FLAG_RF0N = 0,
    FLAG_RF0F = 1,
    FLAG_RF0L = 2,
    FLAG_TC = 7,
    FLAG_EP = 17,
    FLAG_EW = 18,
    FLAG_BO = 19
};

#define INIT       1u
#define CCE        2u
#define ELEMENTS   3u
#define ELEMENT    18u /* words */
#define RX_WORD    (0xB0u / 4u)
#define TX_WORD    (0x278u / 4u)
#define SYNC_READS 3u /* of CCCR until a change of INIT is seen */
#define IDLE_BITS  11u
#define IDLES      129u

static struct {
    uint32_t ram[RAM_BYTES / 4u];
    uint32_t control;
    uint32_t init_wanted;
    unsigned init_reads;
    bool no_clock;
    uint32_t nbtp;
    uint32_t filters;
    uint32_t txbc;
    uint32_t flags;
    uint32_t enabled;
    uint32_t line_select;
    uint32_t lines;
    uint32_t sent_enabled;
    unsigned errors; /* transmit error counter */
    bool bus_off;
    unsigned idles; /* seen since INIT was cleared */
    unsigned rx_get;
    unsigned rx_level;
    bool rx_lost;
    unsigned tx_get;
    unsigned tx_put;
    unsigned tx_level;
    uint32_t pending;
    uint32_t sent;
} self;

void fdcan_model_reset(void)
{
    memset(&self, 0, sizeof self);
    memset(self.ram, 0xA5, sizeof self.ram);
    self.control = INIT;
    self.init_wanted = INIT;
    self.nbtp = 0x06000A03u;
}

void fdcan_model_stop_clock(void)
{
    self.no_clock = true;
}

bool fdcan_model_covers(uint32_t address)
{
    return (address >= REGISTERS && address < REGISTERS_END) ||
           (address >= RAM && address < RAM + 0x400u);
}

static void raise(unsigned flag)
{
    self.flags |= 1u << flag;
}

static bool configurable(void)
{
    return (self.control & (INIT | CCE)) == (INIT | CCE);
}

/* "The following registers are reset when CCE is set": the status of the FIFOs and the requests. */
static void forget_messages(void)
{
    self.rx_get = 0;
    self.rx_level = 0;
    self.rx_lost = false;
    self.tx_get = 0;
    self.tx_put = 0;
    self.tx_level = 0;
    self.pending = 0;
    self.sent = 0;
}

/* INIT takes effect some reads later; CCE can be set only while INIT is, and goes with it. */
static void write_control(uint32_t value)
{
    if ((value & ~(INIT | CCE)) != 0u) {
        chip_forbids("an ordinary node sets INIT and CCE of CCCR only", REGISTERS + CCCR);
    }
    if ((value & INIT) != self.init_wanted) {
        self.init_wanted = value & INIT;
        self.init_reads = SYNC_READS;
    }
    if ((value & CCE) != 0u && (self.control & INIT) != 0u && (value & INIT) != 0u) {
        if ((self.control & CCE) == 0u) {
            forget_messages();
        }
        self.control |= CCE;
    } else {
        self.control &= ~CCE;
    }
}

static uint32_t read_control(void)
{
    if (self.no_clock) {
        return self.control & ~INIT;
    }
    const bool last = self.init_reads == 1u;
    self.init_reads -= self.init_reads > 0u ? 1u : 0u;
    if (last) {
        self.control = (self.control & ~INIT) | self.init_wanted;
        if (self.init_wanted == 0u) {
            self.control &= ~CCE;
            self.idles = 0;
        }
    }
    return self.control;
}

static uint32_t status_word(void)
{
    const uint32_t last_error = 7u;
    const uint32_t passive = self.errors >= 128u ? 1u << 5 : 0u;
    const uint32_t warning = self.errors >= 96u ? 1u << 6 : 0u;
    return last_error | passive | warning | (self.bus_off ? 1u << 7 : 0u) | 0x700u;
}

static uint32_t rx_status(void)
{
    return self.rx_level | self.rx_get << 8 | ((self.rx_get + self.rx_level) % ELEMENTS) << 16 |
           (self.rx_level == ELEMENTS ? 1u << 24 : 0u) | (self.rx_lost ? 1u << 25 : 0u);
}

static uint32_t tx_status(void)
{
    return (ELEMENTS - self.tx_level) | self.tx_get << 8 | self.tx_put << 16 |
           (self.tx_level == ELEMENTS ? 1u << 21 : 0u);
}

static uint32_t read_register(uint32_t offset)
{
    switch (offset) {
    case CREL:
        return 0x32141218u;
    case ENDN:
        return 0x87654321u;
    case CCCR:
        return read_control();
    case NBTP:
        return self.nbtp;
    case ECR:
        return self.errors < 255u ? self.errors : 255u;
    case PSR:
        return status_word();
    case IR:
        return self.flags;
    case IE:
        return self.enabled;
    case ILS:
        return self.line_select;
    case ILE:
        return self.lines;
    case RXGFC:
        return self.filters;
    case RXF0S:
        return rx_status();
    case RXF0A:
        return 0;
    case TXBC:
        return self.txbc;
    case TXFQS:
        return tx_status();
    case TXBRP:
        return self.pending;
    case TXBTO:
        return self.sent;
    case TXBTIE:
        return self.sent_enabled;
    default:
        chip_forbids("this model does not know the register", REGISTERS + offset);
        return 0;
    }
}

uint32_t fdcan_model_read(uint32_t address)
{
    if (address < RAM) {
        return read_register(address - REGISTERS);
    }
    if (address % 4u != 0u || address >= RAM + RAM_BYTES) {
        chip_forbids("message RAM has 212 words", address);
    }
    return self.ram[(address - RAM) / 4u];
}

/* Write-protected unless INIT and CCE are both set. */
static void write_protected(uint32_t *register_value, uint32_t value)
{
    if (configurable()) {
        *register_value = value;
    }
}

static void request(uint32_t buffers)
{
    if (buffers != 1u << self.tx_put || self.tx_level == ELEMENTS) {
        chip_forbids("a FIFO takes the request for its put index only, and while not full",
                     REGISTERS + TXBAR);
    }
    self.pending |= buffers;
    self.sent &= ~buffers;
    self.tx_put = (self.tx_put + 1u) % ELEMENTS;
    self.tx_level++;
}

/* Frees everything up to the element with this index. */
static void acknowledge(uint32_t index)
{
    const unsigned freed = (index + ELEMENTS - self.rx_get) % ELEMENTS + 1u;
    if (index >= ELEMENTS || freed > self.rx_level) {
        chip_forbids("acknowledged an element that holds no frame", REGISTERS + RXF0A);
        return;
    }
    self.rx_get = (index + 1u) % ELEMENTS;
    self.rx_level -= freed;
    self.rx_lost = false;
}

static void write_register(uint32_t offset, uint32_t value)
{
    switch (offset) {
    case CCCR:
        write_control(value);
        break;
    case NBTP:
        write_protected(&self.nbtp, value);
        break;
    case RXGFC:
        write_protected(&self.filters, value);
        break;
    case TXBC:
        write_protected(&self.txbc, value);
        break;
    case IR:
        self.flags &= ~value;
        break;
    case IE:
        self.enabled = value;
        break;
    case ILS:
        self.line_select = value;
        break;
    case ILE:
        self.lines = value;
        break;
    case RXF0A:
        acknowledge(value);
        break;
    case TXBAR:
        request(value);
        break;
    case TXBTIE:
        self.sent_enabled = value;
        break;
    default:
        chip_forbids("not to be written, or unknown to this model", REGISTERS + offset);
        break;
    }
}

static bool belongs_to_the_chip(uint32_t word)
{
    if (word >= TX_WORD) {
        return (self.pending >> ((word - TX_WORD) / ELEMENT) & 1u) != 0u;
    }
    return word >= RX_WORD && self.control == 0u;
}

void fdcan_model_write(uint32_t address, uint32_t value)
{
    if (address < RAM) {
        write_register(address - REGISTERS, value);
        return;
    }
    if (address % 4u != 0u || address >= RAM + RAM_BYTES) {
        chip_forbids("message RAM has 212 words", address);
        return;
    }
    if (belongs_to_the_chip((address - RAM) / 4u)) {
        chip_forbids("a received or requested element is the chip's", address);
    }
    self.ram[(address - RAM) / 4u] = value;
}

static uint32_t timing(unsigned position, unsigned bits)
{
    return (self.nbtp >> position & ((1u << bits) - 1u)) + 1u;
}

static uint32_t quanta(void)
{
    return 1u + timing(8, 8) + timing(0, 7);
}

uint32_t fdcan_model_bits_s(uint32_t clock_hz)
{
    const uint32_t divisor = timing(16, 9) * quanta();
    return clock_hz % divisor == 0u ? clock_hz / divisor : 0u;
}

double fdcan_model_sample_point(void)
{
    return (1.0 + timing(8, 8)) / quanta();
}

uint32_t fdcan_model_jump_quanta(void)
{
    return timing(25, 7);
}

bool fdcan_model_active(void)
{
    return (self.control & INIT) == 0u && !self.bus_off;
}

bool fdcan_model_transmit(struct fdcan_model_frame *frame)
{
    if (!fdcan_model_active() || self.tx_level == 0u) {
        return false;
    }
    const uint32_t *words = &self.ram[TX_WORD + self.tx_get * ELEMENT];
    if ((self.txbc >> 24 & 1u) != 0u) {
        chip_forbids("this model sends from a FIFO, not a queue", REGISTERS + TXBC);
    }
    frame->extended = (words[0] >> 30 & 1u) != 0u;
    frame->remote = (words[0] >> 29 & 1u) != 0u;
    frame->id = frame->extended ? words[0] & 0x1FFFFFFFu : words[0] >> 18 & 0x7FFu;
    frame->dlc = words[1] >> 16 & 15u;
    if ((words[1] & 0xFFF00000u) != 0u || (words[0] & 0x8003FFFFu) != 0u) {
        chip_forbids("a classic frame without events has no other bits", RAM);
    }
    memcpy(frame->data, &words[2], sizeof frame->data);
    const uint32_t buffer = 1u << self.tx_get;
    self.pending &= ~buffer;
    self.sent |= buffer;
    self.tx_get = (self.tx_get + 1u) % ELEMENTS;
    self.tx_level--;
    self.errors -= self.errors > 0u ? 1u : 0u;
    if ((self.sent_enabled & buffer) != 0u) {
        raise(FLAG_TC);
    }
    return true;
}

unsigned fdcan_model_waiting(void)
{
    return self.tx_level;
}

static bool matches(uint32_t element, uint32_t id)
{
    const uint32_t first = element >> 16 & 0x7FFu;
    const uint32_t second = element & 0x7FFu;
    switch (element >> 30) {
    case 0:
        return id >= first && id <= second;
    case 1:
        return id == first || id == second;
    case 2:
        return (id & second) == (first & second);
    default:
        return false;
    }
}

/* Where a data frame with an 11-bit identifier goes: 0 or 1: that FIFO; else nowhere. */
static unsigned destination(uint32_t id)
{
    const uint32_t count = self.filters >> 16 & 31u;
    for (uint32_t i = 0; i < count; ++i) {
        const uint32_t action = self.ram[i] >> 27 & 7u;
        if (action != 0u && matches(self.ram[i], id)) {
            return action == 1u || action == 2u ? action - 1u : 2u;
        }
    }
    return self.filters >> 4 & 3u;
}

static unsigned route(const struct fdcan_model_frame *frame)
{
    const unsigned reject_remote = frame->extended ? 0u : 1u;
    if (frame->remote && (self.filters >> reject_remote & 1u) != 0u) {
        return 2u;
    }
    return frame->extended ? self.filters >> 2 & 3u : destination(frame->id);
}

static void store(const struct fdcan_model_frame *frame)
{
    uint32_t *words = &self.ram[RX_WORD + (self.rx_get + self.rx_level) % ELEMENTS * ELEMENT];
    words[0] = (frame->extended ? 1u << 30 | frame->id : frame->id << 18) |
               (frame->remote ? 1u << 29 : 0u);
    words[1] = (uint32_t)frame->dlc << 16 | 0x1234u; /* a time stamp */
    memcpy(&words[2], frame->data, sizeof frame->data);
    self.rx_level++;
    raise(FLAG_RF0N);
    if (self.rx_level == ELEMENTS) {
        raise(FLAG_RF0F);
    }
}

bool fdcan_model_receive(const struct fdcan_model_frame *frame)
{
    if (!fdcan_model_active()) {
        return false;
    }
    const unsigned fifo = route(frame);
    if (fifo == 1u) {
        chip_forbids("receive FIFO 1 is not read by anybody", REGISTERS + RXGFC);
    }
    if (fifo != 0u) {
        return false;
    }
    if (self.rx_level == ELEMENTS) {
        self.rx_lost = true;
        raise(FLAG_RF0L);
        return false;
    }
    store(frame);
    return true;
}

void fdcan_model_fail(unsigned times)
{
    for (unsigned i = 0; i < times && fdcan_model_active(); ++i) {
        const unsigned before = self.errors;
        self.errors += 8u;
        if (before < 96u && self.errors >= 96u) {
            raise(FLAG_EW);
        }
        if (before < 128u && self.errors >= 128u) {
            raise(FLAG_EP);
        }
        if (self.errors > 255u) {
            self.bus_off = true;
            self.control |= INIT;
            self.init_wanted = INIT;
            self.init_reads = 0;
            raise(FLAG_BO);
        }
    }
}

void fdcan_model_recessive(unsigned bits)
{
    if ((self.control & INIT) != 0u || !self.bus_off) {
        return;
    }
    self.idles += bits / IDLE_BITS;
    if (self.idles >= IDLES) {
        self.bus_off = false;
        self.errors = 0;
        raise(FLAG_BO);
    }
}

bool fdcan_model_interrupt(void)
{
    if (self.line_select != 0u) {
        chip_forbids("line 1 has no handler", REGISTERS + ILS);
    }
    return (self.flags & self.enabled) != 0u && (self.lines & 1u) != 0u;
}

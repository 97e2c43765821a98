/* SPDX-License-Identifier: MIT */
/* od: an object dictionary, as a constant table of entries and one struct with the values. Used by firmware/canopen,
 * firmware/app and sim/node. Changes the struct with the values; no I/O.
 *
 * tools/eds generates both from an EDS file: `struct od_<name>` with a named, typed field for each value, in the
 * processor's byte order, `od_<name>_defaults` and `od_<name>_table`. The application uses the fields directly. This
 * module finds entries, and moves values between the struct and the little-endian bytes of the bus. It makes the checks
 * of CiA 301: existence, access, size, limits of the EDS. 
 *
 *     static struct od_controller values;
 *     values = od_controller_defaults;
 *     od_init(&od, &od_controller_table, &values, &hooks, app);
 *
 * By hooks the application computes a value when it is read, refuses a write, is notified of a write, and moves DOMAIN
 * data. Each hook may be NULL and runs in the context of the caller (SDO: main loop). The read hook should copy fields
 * of 64 bits that another context writes, under the port's lock, because the processor loads them in two instructions.
 *
 * od_find, od_size are pure. All other functions: main loop, if not stated otherwise.
 */
#ifndef CANOPEN_OD_H
#define CANOPEN_OD_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Data types, numbered as in CiA 301 (and in the DataType keys of EDS files). */
enum od_type {
    OD_BOOLEAN = 0x01,
    OD_INTEGER8 = 0x02,
    OD_INTEGER16 = 0x03,
    OD_INTEGER32 = 0x04,
    OD_UNSIGNED8 = 0x05,
    OD_UNSIGNED16 = 0x06,
    OD_UNSIGNED32 = 0x07,
    OD_VISIBLE_STRING = 0x09,
    OD_OCTET_STRING = 0x0A,
    OD_DOMAIN = 0x0F,
    OD_INTEGER64 = 0x15,
    OD_UNSIGNED64 = 0x1B
};

/* Access, as seen from the bus. */
#define OD_READ     0x01u
#define OD_WRITE    0x02u
#define OD_MAPPABLE 0x04u /* may be in a PDO */

struct od_entry {
    uint32_t offset; /* of the value in the storage struct; 0 for a DOMAIN */
    uint16_t index;
    uint16_t size; /* bytes; of a string: the most that it can have; of a DOMAIN: 0 */
    uint8_t sub;
    uint8_t type;   /* enum od_type */
    uint8_t access; /* OD_READ, OD_WRITE, OD_MAPPABLE */
};

/* Lower and upper limit of a number (not of UNSIGNED64). */
struct od_range {
    int64_t low;
    int64_t high;
    uint16_t index;
    uint8_t sub;
};

/* Entries and ranges in rising order of (index, sub). */
struct od_table {
    const struct od_entry *entries;
    const struct od_range *ranges;
    uint16_t entry_count;
    uint16_t range_count;
    uint32_t storage_size; /* sizeof the struct of values */
};

/* Callbacks; those with a result return an SDO abort code or SDO_OK. `context` is od_init's. */
struct od_hooks {
    /* Before a value is read: bring its field up to date. Not called for a DOMAIN. */
    uint32_t (*read)(void *context, const struct od_entry *entry);

    /* Before a value is stored: `value` has `size` bytes as they came from the bus (numbers: little-endian; use
     * cob_get). Type, size and range have been checked. An abort code refuses the write: nothing changes. */
    uint32_t (*write)(void *context, const struct od_entry *entry, const uint8_t *value,
                      uint32_t size);

    /* Whether this value may be written while another SDO transfer is under way (canopen/sdo_server.h): a command to
     * stop. Of one byte; the entry can be written. Must change nothing. NULL: none is. */
    bool (*urgent)(const struct od_entry *entry, uint8_t value);

    /* After the new value is in its field. */
    void (*written)(void *context, const struct od_entry *entry);

    /* A DOMAIN is to be downloaded: `size` bytes, 0 if the client announced none. */
    uint32_t (*domain_begin)(void *context, const struct od_entry *entry, uint32_t size);

    /* The next `size` bytes of it, at `offset`: each byte once, in order. */
    uint32_t (*domain_write)(void *context, const struct od_entry *entry, uint32_t offset,
                             const uint8_t *data, uint32_t size);

    /* All `size` bytes are there and their CRC, if any, was right: take them over or refuse them.
     */
    uint32_t (*domain_end)(void *context, const struct od_entry *entry, uint32_t size);

    /* The download ended early (abort, timeout, reset), or a hook above refused it: forget the bytes. Follows each
     * domain_begin that returned SDO_OK unless domain_end returned SDO_OK. */
    void (*domain_abort)(void *context, const struct od_entry *entry);

    /* A DOMAIN is to be uploaded: set *size. It must not change until the upload has ended. */
    uint32_t (*domain_size)(void *context, const struct od_entry *entry, uint32_t *size);

    /* Copy `size` bytes from `offset` on to `data`; the same bytes may be requested again. */
    uint32_t (*domain_read)(void *context, const struct od_entry *entry, uint32_t offset,
                            uint8_t *data, uint32_t size);
};

struct od {
    const struct od_table *table;
    uint8_t *storage;
    const struct od_hooks *hooks;
    void *context;
};

/* `storage` is the generated struct, already filled (with its defaults); `hooks` may be NULL. All
 * must outlive *od. */
void od_init(struct od *od, const struct od_table *table, void *storage,
             const struct od_hooks *hooks, void *context);

#define OD_FIRST_MANUFACTURER 0x2000u /* the first index that is no communication object */

/* Gives the communication objects, those below OD_FIRST_MANUFACTURER, the values of the generated `od_<name>_defaults`,
 * as NMT reset communication requires. Hooks are not called. */
void od_reset_communication(struct od *od, const void *defaults);

/* The entry (index, sub), or NULL. */
const struct od_entry *od_find(const struct od *od, uint16_t index, uint8_t sub);

/* Why od_find gave NULL: SDO_ABORT_NO_OBJECT or SDO_ABORT_NO_SUB; SDO_OK if the entry exists. */
uint32_t od_missing(const struct od *od, uint16_t index, uint8_t sub);

/* Present size of a value in bytes (a VISIBLE_STRING ends at its first NUL). Not for a DOMAIN. */
uint32_t od_size(const struct od *od, const struct od_entry *entry);

/* Reads a value as the bus sees it: checks access, calls the read hook, encodes at most `capacity`
 * bytes to `out` and sets *size. Result: abort code (SDO_ABORT_MEMORY when capacity is too small).
 * Not for a DOMAIN. */
uint32_t od_read(struct od *od, const struct od_entry *entry, uint8_t *out, uint32_t capacity,
                 uint32_t *size);

/* Writes a value as the bus sees it: checks access, size and range, calls the write hook, stores, calls the written
 * hook. Nothing changes when the result is not SDO_OK. Not for a DOMAIN. */
uint32_t od_write(struct od *od, const struct od_entry *entry, const uint8_t *value, uint32_t size);

/* Whether a number may be in a field, by type and range: SDO_OK or an abort code. No access check, no hooks. Pure. */
uint32_t od_check_number(const struct od *od, const struct od_entry *entry, uint64_t value);

/* The raw number in a field, without access check or hook; for PDO and internal use. Numbers only.
 * Any context. */
uint64_t od_number(const struct od *od, const struct od_entry *entry);
void od_set_number(struct od *od, const struct od_entry *entry, uint64_t value);

#endif

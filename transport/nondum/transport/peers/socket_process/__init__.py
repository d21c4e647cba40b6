"""Sockets to other hosts in a separate process, and the packets between the daemon and it.

What other hosts send before it can be bounded fills the memory of that process, which has a limit.
Packets are lists of plain data, over a pair of SOCK_SEQPACKET sockets. NUMBER is that of a
connection: even where the process accepted it, odd where the daemon dialled.

    daemon → process   trust PIECE IS_LAST            the text of a trust file
                       begin NAME KEYS                who this host is
                       listen ADDRESSES               answered by `listening` or `unusable`
                       dial NUMBER KEY ADDRESS
                       data NUMBER BYTES              at most `WINDOW` that are not `taken` yet
                       peer NUMBER                    an accepted connection is a peer's
                       cut NUMBER LINGER_MS
                       tick                           the loop of the daemon runs
                       close
    process → daemon   listening ADDRESSES, unusable PROBLEMS
                       accepted NUMBER ADDRESS KEY    a first message has come; it is told next
                       connected NUMBER
                       data NUMBER BYTES
                       taken NUMBER COUNT             messages that were handed to ZeroMQ
                       misused NUMBER REASON
                       doubtful NUMBER
                       over NUMBER PROBLEM            the last of that number
                       refused REASON ADDRESS KEY TOLD
                       tock STRANGERS                 the answer to `tick`
"""

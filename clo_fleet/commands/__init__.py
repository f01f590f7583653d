"""The subcommands of ``clo-fleet``, a module each: its ``HELP``, its ``options`` and the ``command`` itself.

Engines are imported inside ``command``: asking for help costs next to nothing.
"""

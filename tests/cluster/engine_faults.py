"""Faults of the engine: the actions of the faults of fault_plan.py that need PostgreSQL nodes only."""
import time

from engine import CUT, HUNG, OPEN
from fault_plan import ENGINE, names

DETECTION_SECONDS = 0.5  # from the loss of a primary to the promotion
AWAKE_SECONDS = 1.0      # for which an old primary is left alone after it woke


class EngineFaults:
    """Actions on an Engine. `clients` are the names of the clients whose links are cut or hang."""

    def __init__(self, engine, clients):
        self.engine, self.clients = engine, list(clients)

    def actions(self):
        """Returns the actions for fault_plan.run(), by the name of the fault."""
        return {name: getattr(self, name.replace("-", "_")) for name in names(ENGINE)}

    def kill_primary(self, _fault):
        self.engine.kill(self.engine.primary)
        self.replace_primary()
        return self.engine.repair

    def replace_primary(self):
        time.sleep(DETECTION_SECONDS)
        self.engine.fail_over()

    def restart_primary(self, _fault):
        self.engine.kill(self.engine.primary)
        return self.engine.repair

    def kill_standby(self, fault):
        self.engine.kill(fault.among(self.engine.standbys()))
        return self.engine.repair

    def freeze_primary(self, _fault):
        old = self.engine.primary
        self.engine.freeze(old)
        self.replace_primary()

        def wake():
            self.engine.thaw(old)
            time.sleep(AWAKE_SECONDS)
            self.engine.repair()
        return wake

    def freeze_standby(self, fault):
        self.engine.freeze(fault.among(self.engine.standbys()))
        return self.engine.repair

    def isolate_primary(self, _fault):
        old = self.engine.primary
        self.engine.isolate(old)
        self.engine.set_links(HUNG, sources=self.clients, nodes=[old])
        self.replace_primary()

        def heal():
            self.engine.heal()
            time.sleep(AWAKE_SECONDS)
            self.engine.repair()
        return heal

    def cut_standbys(self, _fault):
        self.engine.set_links(CUT, sources=[node.name for node in self.engine.standbys()], nodes=[self.engine.primary])
        return self.engine.repair

    def cut_clients(self, _fault):
        return self.clients_until_healed(CUT)

    def hang_engine(self, _fault):
        return self.clients_until_healed(HUNG)

    def clients_until_healed(self, state):
        self.engine.set_links(state, sources=self.clients)
        return lambda: self.engine.set_links(OPEN, sources=self.clients)

    def no_engine(self, _fault):
        for node in self.engine.nodes:
            self.engine.kill(node)
        return self.engine.repair

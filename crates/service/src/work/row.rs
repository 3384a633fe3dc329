//! Those who take turns at something, and whose turn is next.
//!
//! Each has a charge, which a turn raises by [`TURN`], and by as much again at most where it cost much. Next is, of
//! those who have the fewest turns in hand, the one with the least charge, and of equal ones the one whose last turn is
//! longest ago. Since no turn is charged more than twice another, nobody waits for more than two turns of anybody else.
//! Who comes anew is charged almost as for a turn, so that newcomers, however many they are, overtake nobody for long.

/// What every turn is charged.
pub(crate) const TURN: u64 = 1000;
/// What who comes anew is charged: less than those who have had a turn.
const NEWCOMER: u64 = TURN - 1;

/// Those who have turns or wait for one, and for a while those who had one.
#[derive(Debug)]
pub(crate) struct Row<Id, Of> {
    members: Vec<Member<Id, Of>>,
    /// The charge of the newest turn, before it.
    now: u64,
    turns: u64,
}

/// One of those who take turns, and what it waits for.
#[derive(Debug)]
pub(crate) struct Member<Id, Of> {
    pub(crate) id: Id,
    pub(crate) of: Of,
    /// Turns in hand.
    pub(crate) running: usize,
    /// Jobs that wait for a turn.
    pub(crate) waiting: usize,
    charge: u64,
    /// When its last turn was, or when it came.
    last: u64,
}

impl<Id, Of> Default for Row<Id, Of> {
    fn default() -> Self {
        Self { members: Vec::new(), now: 0, turns: 0 }
    }
}

impl<Id: PartialEq + Clone, Of: Default> Row<Id, Of> {
    pub(crate) fn members(&self) -> &[Member<Id, Of>] {
        &self.members
    }

    pub(crate) fn find(&mut self, id: &Id) -> Option<&mut Member<Id, Of>> {
        self.members.iter_mut().find(|member| member.id == *id)
    }

    /// The one of this name, which joins the row where it is not there.
    pub(crate) fn join(&mut self, id: &Id) -> &mut Member<Id, Of> {
        let known = self.members.iter().position(|member| member.id == *id);
        let at = known.unwrap_or_else(|| {
            self.turns += 1;
            let (charge, last) = (self.now + NEWCOMER, self.turns);
            let (id, of) = (id.clone(), Of::default());
            self.members.push(Member { id, of, running: 0, waiting: 0, charge, last });
            self.members.len() - 1
        });
        &mut self.members[at]
    }

    /// Whose turn is next, of those who wait and `may` have one.
    pub(crate) fn next(&self, may: impl Fn(&Member<Id, Of>) -> bool) -> Option<&Member<Id, Of>> {
        let waiting = self.members.iter().filter(|member| member.waiting > 0 && may(member));
        waiting.min_by_key(|member| (member.running, member.charge, member.last))
    }

    /// Gives a turn to one of the row, which need not have waited.
    pub(crate) fn begin(&mut self, id: &Id) {
        self.turns += 1;
        let (turns, now) = (self.turns, self.now);
        let member = self.join(id);
        let charge = member.charge.max(now);
        (member.charge, member.last) = (charge + TURN, turns);
        member.running += 1;
        self.now = charge;
    }

    /// Ends a turn, which costs `extra` besides.
    pub(crate) fn end(&mut self, id: &Id, extra: u64) {
        if let Some(member) = self.find(id) {
            member.running -= 1;
            member.charge += extra.min(TURN);
        }
        self.forget_idle();
    }

    /// Forgets those who have nothing and wait for nothing, once others have been charged as much.
    pub(crate) fn forget_idle(&mut self) {
        let is_idle = |member: &Member<Id, Of>| member.running == 0 && member.waiting == 0;
        if self.members.iter().all(is_idle) {
            self.members.clear();
        }
        let now = self.now;
        self.members.retain(|member| !is_idle(member) || member.charge > now + NEWCOMER);
    }
}

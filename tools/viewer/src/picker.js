// What lies under the pointer: coordinates, vertices, and lengths between them.

import { Raycaster, Vector2 } from 'three';

/** Lengths between points: in space, on the ground, in height. */
function lengths( points ) {

	const pairs = points.slice( 1 ).map( ( point, n ) => [ points[ n ], point ] );
	const sum = of => pairs.reduce( ( total, [ a, b ] ) => total + of( b.local.clone().sub( a.local ) ), 0 );
	return { each: pairs.map( ( [ a, b ] ) => a.local.distanceTo( b.local ) ), all: sum( d => d.length() ), flat: sum( d => Math.hypot( d.x, d.y ) ), rise: sum( d => d.z ) };

}

export class Picker {

	measuring = false;
	#measured = [];
	#raycaster = new Raycaster();

	/** Parts of the page: `canvas`, `world`, `navigator`, `section`, `split`, `marks`; `changed` is told of new marks. */
	constructor( parts ) { Object.assign( this, parts ); }

	get lengths() { return lengths( this.#measured ); }

	/** True if nothing is measured yet. */
	get isEmpty() { return this.#measured.length === 0; }

	/** The nearest shown point of a mesh at a pixel. */
	hit( x, y ) {

		const { canvas, world, navigator, section, split } = this, raycaster = this.#raycaster;
		navigator.apply();
		raycaster.setFromCamera( new Vector2( 2 * x / canvas.clientWidth - 1, 1 - 2 * y / canvas.clientHeight ), navigator.camera );
		if ( navigator.orthographic ) raycaster.ray.origin.addScaledVector( raycaster.ray.direction, - 4 * world.sphere.radius );
		const groups = split.under( world.open, x / canvas.clientWidth ).map( mesh => mesh.tiles.group );
		return raycaster.intersectObjects( groups ).find( found => found.face && section.shows( found.point ) ) ?? null;

	}

	/** The scan's coordinates at a pixel, as text. */
	coordinates( x, y ) {

		const found = this.hit( x, y ), mesh = found?.object.userData.mesh;
		return found ? mesh.toScan( found.point ).map( ( x, k ) => `${ 'XYZ'[ k ] } ${ x.toFixed( Math.min( mesh.decimals, 3 ) ) }` ).join( '   ' ) : '';

	}

	/** The corner of the triangle at a pixel that is nearest to it, with its mesh. */
	vertexAt( x, y ) {

		const found = this.hit( x, y );
		if ( ! found ) return null;
		const { a, b, c } = found.face, { mesh } = found.object.userData;
		const corners = [ a, b, c ].map( index => ( { ...mesh.vertex( found.object, index ), mesh } ) );
		return corners.sort( ( p, q ) => p.local.distanceTo( found.point ) - q.local.distanceTo( found.point ) )[ 0 ];

	}

	clear() {

		this.#measured = [];
		this.marks.set( [] );
		this.panel.noResult();
		this.changed();

	}

	click( x, y ) {

		const vertex = this.vertexAt( x, y ), close = () => this.clear();
		if ( this.measuring ) {

			if ( vertex ) this.#measure( vertex, close );
			return;

		}

		if ( ! vertex ) return this.clear();
		this.marks.set( [ vertex.local ] );
		const { mesh } = vertex;
		const note = mesh.info.exact === false ? 'Rounded: the mesh has finer coordinates than its levels of detail.' : vertex.level > 0 ? 'A vertex of the mesh; there may be nearer ones in finer levels.' : '';
		const title = this.split.two ? `Vertex of ${ mesh.name }` : 'Vertex';
		this.panel.result( title, [ ...vertex.text.map( ( text, k ) => [ 'XYZ'[ k ], text ] ), ...vertex.values ], { text: vertex.text.join( ' ' ), note, close } );
		this.changed();

	}

	#measure( vertex, close ) {

		const measured = this.#measured;
		measured.push( vertex );
		const digits = Math.min( Math.max( this.world.decimals, 2 ), 6 ), { each, all, flat, rise } = lengths( measured );
		this.marks.set( measured.map( v => v.local ), each.map( x => x.toFixed( digits ) ) );
		const rows = [ [ 'Distance', all.toFixed( digits ) ], [ 'On the ground', flat.toFixed( digits ) ], [ 'Height', rise.toFixed( digits ) ] ];
		if ( measured.length > 2 ) rows.push( [ 'Parts', each.length ] );
		this.panel.result( 'Distance', measured.length > 1 ? rows : [ [ 'From', vertex.text.join( '  ' ) ] ], {
			text: measured.length > 1 ? all.toFixed( digits ) : null, note: measured.length > 1 ? 'Between vertices. Another click adds a part.' : 'Click the next point.', close,
		} );
		this.changed();

	}

}
